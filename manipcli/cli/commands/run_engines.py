"""`manipcli run TASK --engines A,B` and `--check-step`: one task in several engines or steps, and their comparison."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.cli import console
from manipcli.cli.interrupts import Interrupts
from manipcli.cli.options import OutputFormat
from manipcli.cli.outputs import Outputs
from manipcli.core.errors import ExitCode, InvalidInput

if TYPE_CHECKING:
    from manipcli.judge.measured_run import Variant


def run_engines(
    task: Path,
    *,
    engines: Sequence[str],
    check_step: bool,
    log: Path | None,
    force: bool,
    embed_meshes: bool,
    report_file: Path | None,
    seed: int | None,
    sample: int | None,
    design: str,
    overrides: Sequence[str],
    format_: OutputFormat,
    package_path: Sequence[Path],
    allow_outside: bool,
    verbose: bool,
    quiet: bool,
    interrupts: Interrupts,
) -> ExitCode:
    """Exit code 0 where all runs passed and agree; 1 where one failed, or they differ.

    Without `engines`: the engine of the task.
    """
    from manipcli import pipeline
    from manipcli.cli.progress import StepProgress
    from manipcli.judge.measured_run import variants_of
    from manipcli.record.faults import RecordingFailed, RecordingRefused
    from manipcli.report.agreement import agreement_json, agreement_text

    outputs = Outputs(report_file, None, others=(task, log), quiet=quiet)
    names = engines or (pipeline.simulation_of(task, overrides=overrides, seed=seed).engine,)

    def started(variant: Variant) -> None:
        if not quiet:
            console.talk(f"run in {variant.name}")

    with StepProgress(verbose=verbose, quiet=quiet, interrupts=interrupts) as progress:
        try:
            compared = pipeline.compare_runs(
                task,
                variants_of(names, check_step=check_step),
                overrides=overrides,
                seed=seed,
                sample=sample,
                design=design,
                log=log,
                force=force,
                embed_meshes=embed_meshes,
                package_path=package_path,
                allow_outside=allow_outside,
                progress=progress,
                started=started,
            )
        except RecordingRefused:
            raise  # nothing was run; an existing page belongs to the logs that are kept
        except RecordingFailed as failure:
            with suppress(OSError):  # the disk may be full for the page, too
                outputs.of_invalid(failure.findings, task=task, log=failure.partial)
            raise
        except InvalidInput as invalid:
            outputs.of_invalid(invalid.findings, task=task)
            raise
    render = agreement_json.render_json if format_ == "json" else agreement_text.render_text
    console.result(render(compared))
    outputs.of_comparison(compared, package_path=package_path, allow_outside=allow_outside)
    return compared.exit_code
