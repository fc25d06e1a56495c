"""`manipcli diff A B`: what is different about two runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import Format
from manipcli.core.errors import ExitCode


def diff(
    a: Annotated[Path, typer.Argument(metavar="A", help="The log of a run.", show_default=False)],
    b: Annotated[Path, typer.Argument(metavar="B", help="The log of another.", show_default=False)],
    *,
    tolerance: Annotated[
        float,
        typer.Option(
            "--tolerance", metavar="X", min=0.0, help="Numbers in messages that differ by no more are the same."
        ),
    ] = 0.0,
    format_: Format = "text",
) -> ExitCode:
    """Compare two logs: how steps went, where messages differ.

    Exit code 0: the same happened; 1: something is different. What they were made from (files, seed, versions) is told,
    but makes no difference by itself.
    """
    from manipcli.logs.diff import diff_logs
    from manipcli.report.logs import log_diff

    made = diff_logs(a, b, tolerance=tolerance)
    console.result((log_diff.render_json if format_ == "json" else log_diff.render_text)(made))
    return ExitCode.PASSED if made.same else ExitCode.FAILED
