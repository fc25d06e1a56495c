"""`manipcli info LOG`: contents of a log."""

from __future__ import annotations

from manipcli.cli import console
from manipcli.cli.options import Format, LogFile
from manipcli.core.errors import ExitCode


def info(log: LogFile, *, format_: Format = "text") -> ExitCode:
    """Show the verdict, steps, topics, rates and sizes of a log.

    Works with any MCAP file, also a truncated or damaged one; missing parts are shown first.
    """
    from manipcli.logs.log_info import log_info
    from manipcli.report.log_info import render_json, render_text

    found = log_info(log)
    console.result(render_json(found) if format_ == "json" else render_text(found))
    return ExitCode.PASSED
