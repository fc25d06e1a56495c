"""Runs of `test --engines` and `--check-step`: a job in its engine, its numbers, and the agreement of several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from manipcli.batch.job import Job, Settings
from manipcli.core.errors import Place
from manipcli.core.whole_file import write_whole
from manipcli.judge.agreement import Agreement, compare
from manipcli.judge.measured_run import MeasuredRun, engine_override
from manipcli.report.agreement.compared_runs import ComparedRuns
from manipcli.report.agreement.disagreement import message, summary
from manipcli.report.run_report import RunReport
from manipcli.report.suite.suite import Case, CaseReport, CaseWord, Trouble


def in_engine(case: Case, path: Path, settings: Settings) -> Job:
    """The job of a case, with the override of its engine; runs in the same engine share what a process prepared."""
    if case.variant is not None:
        settings = replace(settings, overrides=(*settings.overrides, engine_override(case.variant)))
    return Job(case, path, settings)


def with_step(job: Job) -> Job:
    """The job with the override of half the step, where its variant has it; called once, in the process of the run.

    Raises:
        InvalidInput: the task file is invalid.
    """
    from manipcli.task.variants import half_step_override

    if job.case.variant is None or not job.case.variant.half_step:
        return job
    settings = job.settings
    halved = half_step_override(job.path, overrides=settings.overrides, seed=settings.seed)
    return replace(job, settings=replace(settings, overrides=(*settings.overrides, halved)))


def measured(job: Job, report: RunReport) -> MeasuredRun | None:
    """The numbers of a run with a variant, else None; the places have the displayed name of the file."""
    from manipcli.logs.measure_run import measured_run
    from manipcli.spec import load
    from manipcli.task.vocabulary import task_spec

    if job.case.variant is None:
        return None
    settings = job.settings
    task = load.load_task(job.path, model=task_spec(), overrides=settings.overrides, seed=settings.seed)
    run = measured_run(job.case.variant, task, report)
    file = str(job.path)
    places = {
        loc: Place(job.case.file, place.line, place.column) if place.file == file else place
        for loc, place in run.places.items()
    }
    return replace(run, places=places)


def agreement_report(job: Job, runs: Sequence[CaseReport]) -> CaseReport:
    """The report of a case that compares runs, from their reports."""
    lacking = [run for run in runs if run.measured is None]
    if lacking:
        text = "not compared: " + ", ".join(f"'{run.case.name}' {_word(run.outcome)}" for run in lacking)
        return CaseReport(job.case, "error", 0.0, job.command(), text, troubles=(Trouble(text, _task(job)),))
    agreement = compare([run.measured for run in runs if run.measured is not None])
    troubles = tuple(Trouble(message(found), found.place) for found in agreement.disagreements)
    report = CaseReport(
        job.case,
        "passed" if agreement.agrees else "differs",
        0.0,
        job.command(),
        summary(agreement),
        troubles=troubles,
        warnings=agreement.warnings,
        agreement=agreement,
    )
    return _with_page(job, report, agreement, runs)


def _word(outcome: CaseWord) -> str:
    return {"invalid": "is invalid", "error": "has no verdict", "hung": "hung"}.get(outcome, outcome)


def _task(job: Job) -> Place:
    return Place(job.case.file, job.case.line, 1)


def _with_page(job: Job, report: CaseReport, agreement: Agreement, runs: Sequence[CaseReport]) -> CaseReport:
    """Writes the page of a comparison, without a replay, where pages are requested."""
    if job.page is None:
        return report
    from manipcli.report.html.agreement_page import render_page

    compared = ComparedRuns(agreement, tuple(run.run for run in runs if run.run is not None))
    pages = [run.page for run in runs]
    try:
        job.page.parent.mkdir(parents=True, exist_ok=True)
        page = render_page(compared, index=job.index, pages=pages, folder=job.page.parent)
        write_whole(job.page, page.encode())
    except OSError as error:
        return replace(report, notes=(f"no page: {error}",))
    return replace(report, page=str(job.page))
