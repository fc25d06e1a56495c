"""`manipcli graph TASK|LOG`: the data-flow graph."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from manipcli.cli import console
from manipcli.cli.log_files import is_log, one_file
from manipcli.cli.options import AllowOutside, PackagePath
from manipcli.core.errors import ExitCode


def graph(
    file: Annotated[Path, typer.Argument(metavar="TASK|LOG", help="Task file or log.", show_default=False)],
    *,
    format_: Annotated[
        Literal["text", "mermaid", "json"],
        typer.Option("--format", help="Output format: tree, Mermaid flowchart, or one JSON object."),
    ] = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Show the data-flow graph, from the task to the topics.

    Task, planner, controllers, joint limits, drives, engine, sensors, topics; for a log with the number of messages.
    """
    from manipcli.logs.graph import log_graph, task_graph
    from manipcli.report.logs.graph import render

    if is_log(file):
        with one_file(file) as log:
            made = log_graph(log)
    else:
        made = task_graph(file, package_path=tuple(package_path or ()), allow_outside=allow_outside)
    console.result(render(made, format_))
    return ExitCode.PASSED
