"""What `pipeline.py` is made of: files to a task, a task to a plan, a plan to a log, a log to a verdict."""
