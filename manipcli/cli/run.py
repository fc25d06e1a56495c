"""`manipcli run TASK`: validate, plan, simulate, record, judge."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, Overrides, PackagePath, Seed, TaskFile
from manipcli.core.errors import ExitCode


def run(
    task: TaskFile,
    *,
    log: Annotated[
        Path | None, typer.Option("--log", metavar="PATH", help="Where the log goes; runs/<task>.mcap when absent.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a --log file that exists.")] = False,
    seed: Seed = None,
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Tell more.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Tell nothing but the result.")] = False,
) -> ExitCode:
    """Validate, plan, simulate, record and judge a task."""
    from manipcli.cli.interrupts import Interrupts

    with Interrupts() as interrupts:
        from manipcli import pipeline
        from manipcli.cli.progress import StepProgress
        from manipcli.report import json, text
        from manipcli.report.run_report import exit_code

        with StepProgress(verbose=verbose, quiet=quiet, interrupts=interrupts) as progress:
            report = pipeline.run_task(
                task,
                overrides=tuple(overrides or ()),
                seed=seed,
                log=log,
                force=force,
                package_path=tuple(package_path or ()),
                allow_outside=allow_outside,
                progress=progress,
            )
        console.result(json.render_run(report) if format_ == "json" else text.render_run(report, verbose=verbose))
        return exit_code(report.verdict)
