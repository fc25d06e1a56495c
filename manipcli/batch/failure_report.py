"""Reports of a run besides its verdict: causes of a failure with their places, a picture, a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from manipcli.batch.baseline import Key, compared, kept_baseline, measured, read_baseline
from manipcli.batch.job import Job
from manipcli.core.errors import Diagnostic, Loc, Place
from manipcli.core.whole_file import write_whole
from manipcli.judge.verdict import Verdict
from manipcli.logs.invalid_input import invalid_page, invalid_verdict
from manipcli.logs.replay import open_playback
from manipcli.logs.report import log_page, refused_page
from manipcli.pipeline import load_task
from manipcli.replay.cause import Cause, Written
from manipcli.replay.frames import Frames
from manipcli.replay.renderer import png_bytes
from manipcli.report.html.render_page import render_page
from manipcli.report.nesting import block_line
from manipcli.report.run_page import RunPage
from manipcli.report.run_report import RunReport
from manipcli.report.suite.suite import Trouble
from manipcli.report.text import describe_expectation, describe_step
from manipcli.spec import load
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec

SIZE = (960, 720)
"""Width and height of the picture [pixel]."""


def troubles(job: Job, verdict: Verdict) -> tuple[Trouble, ...]:
    """Causes of a failure: errors of the run, then failed steps, then unmet expectations; empty if it passed."""
    if verdict.verdict == "passed":
        return ()
    task = load.load_task(job.path, model=task_spec(), overrides=job.settings.overrides, seed=job.settings.seed)
    steps = [
        Trouble(describe_step(step), _place(job, task, "steps", k), step.ended)
        for k, step in enumerate(verdict.steps)
        if step.went_wrong
    ]
    steps += [Trouble(block_line(block), None, block.ended) for block in verdict.blocks_at_fault]
    refused = any(step.outcome == "failed" and step.started is None for step in verdict.steps)
    unmet = [
        Trouble(describe_expectation(expectation), _place(job, task, *key), expectation.at)
        for key, expectation in zip(task.spec.judged_at, verdict.expectations, strict=False)
        if expectation.missed and not refused
    ]
    if verdict.verdict == "error" or verdict.ended_between:
        errors = [Trouble(finding.message, finding.place) for finding in verdict.errors]
        return (*(errors or [Trouble(verdict.text)]), *steps, *unmet)
    return (*steps, *unmet)


def against_baseline(job: Job, verdict: Verdict) -> tuple[tuple[Trouble, ...], list[str]]:
    """What is worse than the baseline of the task, and notes about what is better; empty without a baseline.

    Raises:
        InvalidInput: the baseline cannot be read.
    """
    old = read_baseline(kept_baseline(job.path))
    if old is None:
        return (), []
    task = load.load_task(job.path, model=task_spec())
    changes = compared(old, measured(verdict, job.log), task.spec.baseline.tolerance)
    loc: dict[Key, Loc] = {("steps", step.id): ("steps", k) for k, step in enumerate(verdict.steps)}
    judged = zip(task.spec.judged_at, verdict.expectations, strict=False)
    loc |= {("margins", expectation.name): key for key, expectation in judged}
    worse = tuple(
        Trouble(f"{change.word} the baseline: {change}", _place(job, task, *loc.get(change.key, ("task",))))
        for change in changes
        if change.worse
    )
    return worse, [f"{change.word} the baseline: {change}" for change in changes if not change.worse]


def _place(job: Job, task: Located[TaskSpec], *key: str | int) -> Place:
    """The place of a key in the task file, with the displayed name of the file."""
    found = task.place(*key)
    return Place(job.case.file, found.line, found.column)


def draw(
    log: Path,
    picture: Path,
    *,
    at: float | None = None,
    meshes: Mapping[str, Path] = {},
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
) -> None:
    """Draws a log at the time `at` [s], or at its end, with the known mesh files `meshes`.

    Raises:
        ManipcliError: the log has nothing to draw, or a mesh is missing.
    """
    playback = open_playback(log, meshes=meshes, package_path=package_path, allow_outside=allow_outside)
    frames = Frames(playback, size=SIZE)
    image = frames.at(playback.end if at is None else min(max(at, playback.start), playback.end))
    write_whole(picture, png_bytes(image))


def write_page(job: Job, report: RunReport, found: Sequence[Trouble]) -> None:
    """Writes the page about the run, as `manipcli run --report` does.

    In a run that passed, `found` is what is worse than the baseline: the page shows it as the cause of the failure.

    Raises:
        ManipcliError: the log has nothing to draw.
    """
    assert job.page is not None, "pages are requested"
    settings = job.settings
    if report.log is None:
        task = load_task(
            job.path,
            overrides=settings.overrides,
            seed=settings.seed,
            sample=job.case.sample,
            package_path=settings.package_path,
            allow_outside=settings.allow_outside,
        )
        page = refused_page(task, report.verdict)
    else:
        page = log_page(
            job.log, meshes=report.meshes, package_path=settings.package_path, allow_outside=settings.allow_outside
        )
    if report.verdict.verdict == "passed" and found:
        page = replace(page, verdict=replace(page.verdict, verdict="failed"), causes=_causes(page, found))
    _write(job, replace(page, warnings=report.warnings))


def write_invalid_page(job: Job, findings: Sequence[Diagnostic]) -> None:
    """Writes the page about an invalid task, as `manipcli run --report` does, where pages are requested.

    Raises:
        OSError: the page cannot be written.
    """
    if job.page is not None:
        _write(job, invalid_page(invalid_verdict(job.path, findings), findings))


def _write(job: Job, page: RunPage) -> None:
    assert job.page is not None, "pages are requested"
    job.page.parent.mkdir(parents=True, exist_ok=True)
    write_whole(job.page, render_page(replace(page, index=job.index)).encode())


def _causes(page: RunPage, found: Sequence[Trouble]) -> tuple[Cause, ...]:
    """Troubles for a page, those of steps and expectations with their lines."""
    lines = {line.place: line for line in (*page.steps, *page.expectations)}

    def written(place: Place | None) -> Written | None:
        if place is None:
            return None
        return lines.get(f"{Path(place.file).name}:{place.line}", Written(str(place)))

    return tuple(Cause(trouble.message, "", trouble.at, written(trouble.place)) for trouble in found)
