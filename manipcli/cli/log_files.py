"""Logs on the command line: files, and folders of rosbag2."""

from __future__ import annotations

from pathlib import Path


def is_log(path: Path) -> bool:
    """Whether an argument is a log rather than a file of a task."""
    from manipcli.record.records import begins_as_log

    return path.suffix in (".mcap", ".partial") or begins_as_log(path)
