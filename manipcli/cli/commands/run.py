"""`manipcli run TASK`: validate, plan, simulate, record, judge."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.engine_options import CheckStep, Engines, engine_names, refuse_single_outputs
from manipcli.cli.options import (
    AllowOutside,
    Design,
    Format,
    Overrides,
    PackagePath,
    Sample,
    Seed,
    TaskFile,
    check_design,
)
from manipcli.cli.outputs import JunitFile, Outputs, ReportFile
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput


def run(
    task: TaskFile,
    *,
    log: Annotated[
        Path | None,
        typer.Option(
            "--log",
            metavar="PATH",
            help="Write the log to PATH; - is stdout, with the report on stderr [default: runs/<task>.mcap].",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the --log file if it exists.")] = False,
    embed_meshes: Annotated[
        bool,
        typer.Option(
            "--embed-meshes",
            help="Store the mesh files in the log, for replay and export on machines without the robot's packages. "
            "Other viewers do not read them: see export --foxglove.",
        ),
    ] = False,
    engines: Engines = None,
    check_step: CheckStep = False,
    from_step: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="STEP",
            help="Begin at STEP (or a block), with the state of an earlier run; the log is runs/<task>@from.mcap.",
        ),
    ] = None,
    state: Annotated[
        Path | None,
        typer.Option("--state", metavar="LOG", help="Log with the state before --from [default: runs/<task>.mcap]."),
    ] = None,
    until: Annotated[str | None, typer.Option("--until", metavar="STEP", help="End after STEP (or a block).")] = None,
    report_file: ReportFile = None,
    junit: JunitFile = None,
    seed: Seed = None,
    sample: Sample = None,
    design: Design = "",
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Verbose output.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the result.")] = False,
) -> ExitCode:
    """Validate, plan, simulate, record and judge a task.

    With --engines or --check-step, several times: each run has its own log, runs/<task>@<engine>.mcap. The exit code
    is 1 if a run fails, or if verdicts differ, or numbers by more than `agree:` of the task allows.
    """
    from manipcli.cli.interrupts import Interrupts
    from manipcli.cli.log_to_stdout import refuse_stdout, stdout_or

    check_design(design, sample)
    to_stdout = log is not None and str(log) == "-"
    if state is not None and from_step is None:
        raise InvalidInput([Diagnostic("USE123", "--state needs --from STEP", hint="name the first step to run")])
    if engines is not None or check_step:
        from manipcli.cli.commands.run_engines import run_engines

        refuse_single_outputs(to_stdout=to_stdout, junit=junit)
        if from_step is not None or until is not None:
            raise InvalidInput([Diagnostic("USE123", "--from and --until run one engine, without --engines")])
        names = engine_names(engines, check_step=check_step, overrides=tuple(overrides or ()))
        with Interrupts() as interrupts:
            return run_engines(
                task,
                engines=names,
                check_step=check_step,
                log=log,
                force=force,
                embed_meshes=embed_meshes,
                report_file=report_file,
                seed=seed,
                sample=sample,
                design=design,
                overrides=tuple(overrides or ()),
                format_=format_,
                package_path=tuple(package_path or ()),
                allow_outside=allow_outside,
                verbose=verbose,
                quiet=quiet,
                interrupts=interrupts,
            )
    if to_stdout:
        refuse_stdout(format_)
    outputs = Outputs(report_file, junit, others=(task, None if to_stdout else log), quiet=quiet)
    with Interrupts() as interrupts, stdout_or(log) as path:
        from manipcli import pipeline
        from manipcli.cli.progress import StepProgress
        from manipcli.record.faults import RecordingFailed, RecordingRefused
        from manipcli.report import json, text
        from manipcli.report.run_report import exit_code

        folders, words = tuple(package_path or ()), tuple(overrides or ())
        with StepProgress(verbose=verbose, quiet=quiet, interrupts=interrupts) as progress:
            try:
                report = pipeline.run_task(
                    task,
                    overrides=words,
                    seed=seed,
                    sample=sample,
                    design=design,
                    log=path,
                    force=force,
                    embed_meshes=embed_meshes,
                    from_step=from_step,
                    until=until,
                    state=state,
                    package_path=folders,
                    allow_outside=allow_outside,
                    progress=progress,
                )
            except RecordingRefused:
                raise  # nothing was run; existing reports belong to the log that is kept
            except RecordingFailed as failure:
                with suppress(OSError):  # the disk may be full for these, too
                    outputs.of_invalid(failure.findings, task=task, log=failure.partial)
                raise
            except InvalidInput as invalid:
                outputs.of_invalid(invalid.findings, task=task)
                raise
        written = report.log
        if to_stdout:
            report = replace(report, log="stdout" if report.log is not None else None)
            console.error(text.render_run(report, verbose=verbose))
        else:
            console.result(json.render_run(report) if format_ == "json" else text.render_run(report, verbose=verbose))
        if outputs.wanted and written is not None:
            outputs.of_log(
                Path(written),
                report.verdict,
                task=task,
                overrides=words,
                warnings=report.warnings,
                meshes=report.meshes,
                package_path=folders,
                allow_outside=allow_outside,
            )
        elif outputs.wanted:
            refused = pipeline.load_task(
                task,
                overrides=words,
                seed=seed,
                sample=sample,
                design=design,
                package_path=folders,
                allow_outside=allow_outside,
            )
            outputs.of_refusal(refused, report.verdict, task, report.warnings)
        return exit_code(report.verdict)
