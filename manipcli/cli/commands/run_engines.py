"""`manipcli run TASK --engines A,B` and `--check-step`: one task in several engines or steps, and their comparison."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.cli import console
from manipcli.cli.engine_options import variants_of
from manipcli.cli.interrupts import Interrupts
from manipcli.cli.options import OutputFormat
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import ExitCode

if TYPE_CHECKING:
    from manipcli.judge.measured_run import Variant
    from manipcli.report.agreement.compared_runs import ComparedRuns


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
    from manipcli.report.agreement import agreement_json, agreement_text

    check_outputs(("--report", report_file), reads=(task, log))
    names = engines or (pipeline.simulation_of(task, overrides=overrides, seed=seed).engine,)

    def started(variant: Variant) -> None:
        if not quiet:
            console.talk(f"run in {variant.name}")

    with StepProgress(verbose=verbose, quiet=quiet, interrupts=interrupts) as progress:
        compared = pipeline.compare_runs(
            task,
            variants_of(names, check_step=check_step),
            overrides=overrides,
            seed=seed,
            sample=sample,
            log=log,
            force=force,
            embed_meshes=embed_meshes,
            package_path=package_path,
            allow_outside=allow_outside,
            progress=progress,
            started=started,
        )
    render = agreement_json.render_json if format_ == "json" else agreement_text.render_text
    console.result(render(compared))
    if report_file is not None:
        _write_page(report_file, compared, package_path=package_path, allow_outside=allow_outside, quiet=quiet)
    return compared.exit_code


def _write_page(
    path: Path, compared: ComparedRuns, *, package_path: Sequence[Path], allow_outside: bool, quiet: bool
) -> None:
    from manipcli.core.whole_file import write_whole
    from manipcli.logs.agreement_page import ghost_playback
    from manipcli.report.html.agreement_page import render_page

    with suppress(FileNotFoundError):
        path.unlink()  # no page of an earlier run is left where writing fails
    playback, ghosts = ghost_playback(compared, package_path=package_path, allow_outside=allow_outside)
    write_whole(path, render_page(compared, playback, ghosts).encode())
    if not quiet:
        console.talk(f"written: {path}")
