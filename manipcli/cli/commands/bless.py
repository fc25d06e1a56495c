"""`manipcli bless [PATH...]`: baselines of tasks (durations, energy, margins), written next to their files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, PackagePath
from manipcli.core.errors import ExitCode
from manipcli.core.text import number_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from manipcli.batch.job import Job
    from manipcli.report.suite.suite import CaseReport


def bless(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[PATH]...", help="Task files or folders [default: .].", show_default=False),
    ] = None,
    *,
    jobs: Annotated[int, typer.Option("-n", metavar="N", min=1, help="Number of parallel runs.")] = 1,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Run tasks and write their baselines.

    `manipcli test` compares a task with TASK.baseline.json next to its file, and fails where a value is worse by more
    than `baseline: {tolerance: ...}` of the task. A task that fails keeps its baseline.
    """
    from manipcli.cli.interrupts import Interrupts

    with Interrupts():
        from manipcli.batch.job import Settings
        from manipcli.cli.task_session import TaskSession
        from manipcli.report.suite.suite_json import render_suite
        from manipcli.report.suite.suite_text import render_case, render_summary

        settings = Settings(
            folder=Path("runs") / "bless",
            keep_logs=True,
            baseline=False,
            package_path=tuple(package_path or ()),
            allow_outside=allow_outside,
        )
        blessed: dict[str, CaseReport] = {}
        with TaskSession(paths or [Path()], settings) as session:

            def ended(done: CaseReport) -> None:
                if done.passed:
                    lines = _blessed(session.jobs[done.case.id], done)
                    blessed[done.case.id] = _without_log(done, lines)
                else:
                    lines = [render_case(done), "  baseline not written"]
                if format_ == "text":
                    console.result("\n".join(lines))

            if not session.jobs and format_ == "text":
                console.result("nothing to bless: no task file found")
            suite = session.run(at_once=jobs, ended=ended)
        suite = replace(suite, reports=tuple(blessed.get(report.case.id, report) for report in suite.reports))
        if format_ == "json":
            console.result(render_suite(suite))
        elif suite.stopped:
            console.result(render_summary(suite))
        return suite.exit_code


def _without_log(done: CaseReport, lines: Sequence[str]) -> CaseReport:
    """The report of a blessed run with the printed lines as notes; its log was removed."""
    run = None if done.run is None else replace(done.run, log=None)
    return replace(done, run=run, log=None, notes=(*done.notes, *(line.strip() for line in lines)))


def _blessed(job: Job, done: CaseReport) -> Sequence[str]:
    """Writes the baseline; returns the lines to print."""
    from manipcli.batch.baseline import (
        baseline_path,
        compared,
        kept_baseline,
        measured,
        read_baseline,
        write_baseline,
    )
    from manipcli.batch.discovery import shown_path
    from manipcli.core.errors import InvalidInput
    from manipcli.judge.measures.floors import FLOORS
    from manipcli.report.display_quantity import quantity
    from manipcli.report.text import PASS
    from manipcli.spec.baseline import ToleranceSpec

    assert done.run is not None, "a task that passed was run"
    path = baseline_path(job.path)
    new = measured(done.run.verdict, job.log)
    job.log.unlink(missing_ok=True)
    try:
        old = read_baseline(kept_baseline(job.path))
    except InvalidInput:
        old = None  # it is replaced
    write_baseline(path, new)
    parts = [str(new[key]) for key in (("duration",), ("energy",)) if key in new]
    parts.append(number_of(sum(key[0] == "margins" for key in new), "margin"))
    lines = [f"{PASS} {done.case.id} blessed: {', '.join(parts)}; written: {shown_path(path)}"]
    exact = ToleranceSpec(duration=0.0, energy=0.0, margin=0.0)
    changes = compared(old, new, exact) if old is not None else ()
    if old is not None and not changes:
        return [*lines, f"  unchanged within {', '.join(quantity(floor, unit) for unit, floor in FLOORS.items())}"]
    return [*lines, *(f"  {change.word} the old baseline: {change}" for change in changes)]
