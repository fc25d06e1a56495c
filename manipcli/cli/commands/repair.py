"""`manipcli repair LOG`: a clean file of what a killed run or a bad disk left."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import Format, LogFile
from manipcli.core.errors import ExitCode


def repair(
    log: LogFile,
    *,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="OUT", help="Where the clean file goes; LOG.repaired.mcap when absent."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace OUT if it exists.")] = False,
    format_: Format = "text",
) -> ExitCode:
    """Make a clean log of one that was cut or never finished.

    Of a damaged one, too; what is lost is told. LOG itself is never changed.
    """
    from manipcli.cli.interrupts import Interrupts
    from manipcli.record.foreign.repair import default_output
    from manipcli.record.foreign.repair import repair as repaired
    from manipcli.report.logs.repaired import render_json, render_text

    with Interrupts():
        done = repaired(log, output if output is not None else default_output(log), overwrite=force)
        console.result(render_json(done) if format_ == "json" else render_text(done))
    return ExitCode.PASSED
