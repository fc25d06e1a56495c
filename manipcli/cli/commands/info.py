"""`manipcli info LOG`: what a log holds."""

from __future__ import annotations

from manipcli.cli import console
from manipcli.cli.options import Format, LogFile
from manipcli.core.errors import ExitCode


def info(log: LogFile, *, format_: Format = "text") -> ExitCode:
    """Show what a log holds: verdict, steps, topics, rates, sizes.

    Any MCAP file will do, also one that was cut or damaged; what is missing is told first.
    """
    from manipcli.logs.log_info import log_info
    from manipcli.report.logs.log_info import render_json, render_text

    found = log_info(log)
    console.result(render_json(found) if format_ == "json" else render_text(found))
    return ExitCode.PASSED
