"""The command line: parses arguments, calls the pipeline, prints what `report` rendered, returns an exit code."""
