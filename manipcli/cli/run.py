"""`manipcli run TASK`: validate, plan, simulate, record, judge."""

from __future__ import annotations

from dataclasses import replace
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
        Path | None,
        typer.Option(
            "--log",
            metavar="PATH",
            help="Where the log goes; runs/<task>.mcap when absent; - is stdout, the report stderr.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a --log file that exists.")] = False,
    embed_meshes: Annotated[
        bool, typer.Option("--embed-meshes", help="Put the mesh files into the log: it needs no package then.")
    ] = False,
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
    from manipcli.cli.log_to_stdout import refuse_stdout, stdout_or

    to_stdout = log is not None and str(log) == "-"
    if to_stdout:
        refuse_stdout(format_)
    with Interrupts() as interrupts, stdout_or(log) as path:
        from manipcli import pipeline
        from manipcli.cli.progress import StepProgress
        from manipcli.report import json, text
        from manipcli.report.run_report import exit_code

        with StepProgress(verbose=verbose, quiet=quiet, interrupts=interrupts) as progress:
            report = pipeline.run_task(
                task,
                overrides=tuple(overrides or ()),
                seed=seed,
                log=path,
                force=force,
                embed_meshes=embed_meshes,
                package_path=tuple(package_path or ()),
                allow_outside=allow_outside,
                progress=progress,
            )
        if to_stdout:
            report = replace(report, log="stdout" if report.log is not None else None)
            console.talk(text.render_run(report, verbose=verbose))
        else:
            console.result(json.render_run(report) if format_ == "json" else text.render_run(report, verbose=verbose))
        return exit_code(report.verdict)
