"""`manipcli repair LOG`: a complete MCAP file from a truncated, damaged or unfinished one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import Format
from manipcli.core.errors import ExitCode


def repair(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="MCAP file.", show_default=False)],
    *,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="OUT", help="Write the repaired log to OUT [default: LOG.repaired.mcap]."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace OUT if it exists.")] = False,
    format_: Format = "text",
) -> ExitCode:
    """Repair a truncated, damaged or unfinished log.

    Shows what is lost. LOG itself is never changed.
    """
    from manipcli.cli.interrupts import Interrupts
    from manipcli.record.foreign.repair import default_output
    from manipcli.record.foreign.repair import repair as repaired
    from manipcli.report.logs.repaired import render_json, render_text

    with Interrupts():
        done = repaired(log, output if output is not None else default_output(log), overwrite=force)
        console.result(render_json(done) if format_ == "json" else render_text(done))
    return ExitCode.PASSED
