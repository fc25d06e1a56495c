"""What is told of a run besides its verdict: why it did not pass and where that was written, a picture, a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from manipcli.batch.baseline import Key, compared, kept_baseline, measured, read_baseline
from manipcli.batch.job import Job
from manipcli.core.errors import Diagnostic, Loc, Place
from manipcli.core.whole_file import write_whole
from manipcli.judge.verdict import Verdict
from manipcli.logs.invalid import invalid_page, invalid_verdict
from manipcli.logs.replay import open_playback
from manipcli.logs.report import log_page, refused_page
from manipcli.pipeline import load_task
from manipcli.replay.frames import Frames
from manipcli.replay.renderer import png_bytes
from manipcli.report.html.render_page import render_page
from manipcli.report.run_page import Cause, RunPage, Written
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
    """What no step or expectation tells, then steps that went wrong, then expectations; none of what passed."""
    if verdict.verdict == "passed":
        return ()
    task = load.load_task(job.path, model=task_spec(), overrides=job.settings.overrides, seed=job.settings.seed)
    steps = [
        Trouble(describe_step(step), _place(job, task, "steps", k), step.ended)
        for k, step in enumerate(verdict.steps)
        if step.went_wrong
    ]
    refused = any(step.outcome == "failed" and step.started is None for step in verdict.steps)
    unmet = [
        Trouble(describe_expectation(one), _place(job, task, *key), one.at)
        for key, one in zip(task.spec.judged_at, verdict.expectations, strict=False)
        if one.outcome != "passed" and not refused
    ]
    if verdict.verdict == "error" or verdict.ended_between:
        told = [Trouble(finding.message, finding.place) for finding in verdict.errors]
        return (*(told or [Trouble(verdict.text)]), *steps, *unmet)
    return (*steps, *unmet)


def against_baseline(job: Job, verdict: Verdict) -> tuple[tuple[Trouble, ...], list[str]]:
    """What is worse than the baseline of the task, and notes of what is better; nothing where it has none.

    Raises:
        InvalidInput: its baseline cannot be read.
    """
    old = read_baseline(kept_baseline(job.path))
    if old is None:
        return (), []
    task = load.load_task(job.path, model=task_spec())
    changes = compared(old, measured(verdict, job.log), task.spec.baseline.tolerance)
    loc: dict[Key, Loc] = {("steps", step.id): ("steps", k) for k, step in enumerate(verdict.steps)}
    judged = zip(task.spec.judged_at, verdict.expectations, strict=False)
    loc |= {("margins", one.name): key for key, one in judged}
    worse = tuple(
        Trouble(f"{one.word} the baseline: {one}", _place(job, task, *loc.get(one.key, ("task",))))
        for one in changes
        if one.worse
    )
    return worse, [f"{one.word} the baseline: {one}" for one in changes if not one.worse]


def _place(job: Job, task: Located[TaskSpec], *key: str | int) -> Place:
    """Where something stands in the task file, under the name by which that is shown."""
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
    """The picture of a moment of a log, `at` [s], or of its end, with the files of `meshes`, where they are known.

    Raises:
        ManipcliError: the log shows nothing, or a mesh is not there.
    """
    playback = open_playback(log, meshes=meshes, package_path=package_path, allow_outside=allow_outside)
    with Frames(playback, size=SIZE) as frames:
        image = frames.at(playback.end if at is None else min(max(at, playback.start), playback.end))
    write_whole(picture, png_bytes(image))


def write_page(job: Job, report: RunReport, found: Sequence[Trouble]) -> None:
    """The page about the run, as `manipcli run --report` makes it. What is `found` to be worse than its baseline in a
    run that passed is why the test failed.

    Raises:
        ManipcliError: the log shows nothing.
    """
    assert job.page is not None, "a page is wanted"
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
    """The page about a task that cannot be used, as `manipcli run --report` makes it, where pages are wanted.

    Raises:
        OSError: it cannot be written.
    """
    if job.page is not None:
        _write(job, invalid_page(invalid_verdict(job.path, findings), findings))


def _write(job: Job, page: RunPage) -> None:
    assert job.page is not None, "a page is wanted"
    job.page.parent.mkdir(parents=True, exist_ok=True)
    write_whole(job.page, render_page(replace(page, index=job.index)).encode())


def _causes(page: RunPage, found: Sequence[Trouble]) -> tuple[Cause, ...]:
    """Troubles for a page, those of steps and expectations with their lines."""
    lines = {one.place: one for one in (*page.steps, *page.expectations)}

    def written(place: Place | None) -> Written | None:
        if place is None:
            return None
        return lines.get(f"{Path(place.file).name}:{place.line}", Written(str(place)))

    return tuple(Cause(one.message, "", one.at, written(one.place)) for one in found)
