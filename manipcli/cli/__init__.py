"""The command line: parses arguments, calls the pipeline, prints what `report` renders, returns an exit code."""
