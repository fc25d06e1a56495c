"""`manipcli at LOG T`: a log at one moment."""

from __future__ import annotations

from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import Format, LogFile
from manipcli.core.errors import ExitCode


def at(
    log: LogFile,
    time: Annotated[
        str, typer.Argument(metavar="T", help="From the beginning of the log: 3.2, '3.2 s', 250ms.", show_default=False)
    ],
    *,
    format_: Format = "text",
) -> ExitCode:
    """Show a log at one moment: joints, poses of objects, contacts, the step that is on.

    Any ROS 2 log will do, as far as it goes.
    """
    from manipcli.cli.options import seconds
    from manipcli.flow.moment import moment
    from manipcli.report.moment import render_json, render_text

    found = moment(log, seconds(time))
    console.result(render_json(found) if format_ == "json" else render_text(found))
    return ExitCode.PASSED
