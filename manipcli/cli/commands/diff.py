"""`manipcli diff A B`: differences between two logs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.log_files import opened
from manipcli.cli.options import Format
from manipcli.core.errors import ExitCode


def diff(
    a: Annotated[Path, typer.Argument(metavar="A", help="Log of a run.", show_default=False, callback=opened)],
    b: Annotated[Path, typer.Argument(metavar="B", help="Log of another run.", show_default=False, callback=opened)],
    *,
    tolerance: Annotated[
        float,
        typer.Option("--tolerance", metavar="X", min=0.0, help="Ignore differences of numbers in messages up to X."),
    ] = 0.0,
    format_: Format = "text",
) -> ExitCode:
    """Compare two logs: outcomes of steps, differences of messages.

    Differences of files, seed and versions are shown, but do not change the exit code.
    """
    from manipcli.logs.diff import diff_logs
    from manipcli.report.logs import log_diff

    made = diff_logs(a, b, tolerance=tolerance)
    console.result((log_diff.render_json if format_ == "json" else log_diff.render_text)(made))
    return ExitCode.PASSED if made.same else ExitCode.FAILED
