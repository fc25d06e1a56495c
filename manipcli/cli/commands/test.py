"""`manipcli test [PATH...]`: every task file below the paths, run as a test in a process of its own."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, Overrides, PackagePath, Seed, seconds
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import ExitCode, Finding, InvalidInput
from manipcli.core.text import number_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from manipcli.batch.job import Job, Settings
    from manipcli.batch.process import Process
    from manipcli.report.suite import CaseReport, Suite


def test(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[PATH]...", help="Task files, or folders; this one when absent.", show_default=False),
    ] = None,
    *,
    jobs: Annotated[
        int | None, typer.Option("-n", metavar="N", min=1, help="Runs at a time; as many as there are cores.")
    ] = None,
    keyword: Annotated[
        str, typer.Option("-k", metavar="EXPR", help="Only those whose id or tags match: 'pour and not slow'.")
    ] = "",
    last_failed: Annotated[
        bool, typer.Option("--last-failed", "--lf", help="Only those that failed last; all if none did.")
    ] = False,
    samples: Annotated[
        int | None, typer.Option("--samples", metavar="N", min=1, help="Samples 0 to N-1 of each task that varies.")
    ] = None,
    first: Annotated[bool, typer.Option("--exitfirst", "-x", help="Stop at the first failure.")] = False,
    timeout: Annotated[
        str, typer.Option("--timeout", metavar="T", help="End a run that takes longer; 0: never.")
    ] = "10 min",
    silence: Annotated[
        str, typer.Option("--silence", metavar="T", help="End a run that shows no progress for so long; 0: never.")
    ] = "60 s",
    junit: Annotated[Path | None, typer.Option("--junit", metavar="FILE.xml", help="Write JUnit XML, for CI.")] = None,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="DIR", help="Write a page about each run, and an index.html.")
    ] = None,
    github: Annotated[
        bool, typer.Option("--github", help="Annotate the lines that failed, for GitHub Actions.")
    ] = False,
    logs: Annotated[
        Path | None,
        typer.Option("--logs", metavar="DIR", help="Where logs and pictures go; runs/test when absent."),
    ] = None,
    keep_logs: Annotated[bool, typer.Option("--keep-logs", help="Keep the logs of runs that passed, too.")] = False,
    seed: Seed = None,
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Tell only what fails, and the summary.")] = False,
) -> ExitCode:
    """Run tasks as tests, each in a process of its own.

    Tests are the YAML files with a name under the top-level key `task`, and the key `robot`; hidden folders, virtual
    environments, runs, build, dist and node_modules are not entered. Logs and pictures of what failed go to
    runs/test. Tasks that are run as they are written, without --set, --seed and --samples, are compared with their
    baselines, see `bless`.
    """
    from manipcli.cli.interrupts import Interrupts

    with Interrupts():
        from manipcli.batch.job import FOLDER, Settings, limit
        from manipcli.batch.pool import remove_empty

        settings = Settings(
            overrides=tuple(overrides or ()),
            seed=seed,
            package_path=tuple(package_path or ()),
            allow_outside=allow_outside,
            folder=logs or FOLDER,
            pages=report,
            junit=junit is not None,
            keep_logs=keep_logs,
            silence=limit(_time("--silence", silence)),
            timeout=limit(_time("--timeout", timeout)),
        )
        check_outputs(("--junit", junit))
        _check_replaced(junit)
        _check_folder("--report", report)
        _check_folder("--logs", settings.folder, hint=None if logs else "--logs DIR names another place")
        places = paths or [Path()]
        chosen, among = _jobs(places, settings, keyword=keyword, samples=samples, last_failed=last_failed)
        at_once = min(jobs or _cores(), max(1, len(chosen)))
        lines = _Lines(chosen, text=format_ == "text", quiet=quiet)
        suite = _run(chosen, at_once, lines, first=first)
        suite = replace(suite, notes=(*suite.notes, *_notes(chosen, among, keyword, places)))
        remove_empty(settings.folder)
        lines.clear()
        unwritten = _write(suite, junit, report)
        _tell(replace(suite, notes=(*suite.notes, *unwritten)), format_, github=github)
        return suite.exit_code or (ExitCode.INTERNAL if unwritten else ExitCode.PASSED)


def _jobs(
    paths: Sequence[Path], settings: Settings, *, keyword: str, samples: int | None, last_failed: bool
) -> tuple[tuple[Job, ...], tuple[Job, ...]]:
    """What is to be run, in order; and what there was to choose from."""
    from manipcli.batch.discovery import failed_of, read_case, samples_of, shown_path, task_files
    from manipcli.batch.job import Job
    from manipcli.batch.last_failed import last_failed as known
    from manipcli.batch.selection import chosen_by

    chosen = chosen_by(keyword) if keyword else lambda _: True
    failed = known(settings.folder) if last_failed else frozenset()
    found: list[Job] = []
    again: list[Job] = []
    for file in task_files(paths, tell=console.talk):
        case = read_case(file, shown=shown_path(file))
        cases = samples_of(case, samples)
        found += (Job(one, file, settings) for one in cases)
        again += (Job(one, file, settings) for one in failed_of(case, failed) if samples is None or one in cases)
    matching = [[job for job in jobs if chosen(job.case)] for jobs in (again, found)]
    return tuple(matching[0] or matching[1]), tuple(found)


def _notes(jobs: Sequence[Job], among: Sequence[Job], keyword: str, places: Sequence[Path]) -> Iterator[str]:
    """What a user would miss."""
    from manipcli.batch.baseline import kept_baseline
    from manipcli.batch.discovery import baselines_of_none, shown_path

    if keyword and among and not jobs:
        yield f"-k '{keyword}' matches none of {number_of(len(among), 'test')}"
    for file in baselines_of_none(places, [job.path for job in among]):
        yield f"{shown_path(file)} is the baseline of no task here: rename it as its task, or remove it"
    uncompared = sum(not job.nominal and kept_baseline(job.path).exists() for job in jobs)
    if uncompared:
        why = "it is that of the task as it is written, without --set, --seed and --samples"
        yield f"{number_of(uncompared, 'test')} not compared with the baseline: {why}"


def _run(jobs: Sequence[Job], at_once: int, lines: _Lines, *, first: bool) -> Suite:
    from manipcli.batch.last_failed import remember
    from manipcli.batch.pool import run_jobs
    from manipcli.report.suite import Suite

    began = time.monotonic()
    reports: list[CaseReport] = []
    stopped: Literal["", "interrupted", "first failure"] = ""
    notes: tuple[str, ...] = ()
    running = run_jobs(jobs, at_once=at_once, onlooker=lines.running)
    try:
        for done in running:
            reports.append(done)
            lines.ended(done)
            if first and not done.passed and len(reports) < len(jobs):
                stopped = "first failure"
                break
    except KeyboardInterrupt:
        stopped = "interrupted"
        notes = tuple(f"interrupted: {one.job.case.id}: {one.doing}" for one in lines.now)
    finally:
        running.close()
    if reports:
        try:
            remember(jobs[0].settings.folder, reports)
        except OSError as error:
            console.talk(f"what failed is not remembered: {error}")
    order = {job.case.id: k for k, job in enumerate(jobs)}
    reports.sort(key=lambda one: order[one.case.id])
    known = {one.case.id for one in reports}
    undone = tuple(job.case for job in jobs if job.case.id not in known)
    return Suite(tuple(reports), len(jobs), at_once, time.monotonic() - began, stopped, notes, undone)


class _Lines:
    """What is shown while it goes on: a line each case that ends, and on a terminal what is running."""

    def __init__(self, jobs: Sequence[Job], *, text: bool, quiet: bool) -> None:
        from manipcli.report.suite_text import id_width

        self._total, self._done = len(jobs), 0
        self._width = id_width([job.case for job in jobs])
        self._text, self._quiet = text, quiet
        self._live = console.is_live() and not quiet
        self.now: Sequence[Process] = ()

    def running(self, processes: Sequence[Process]) -> None:
        self.now = processes
        if self._live:
            told = "   ".join(f"{one.job.case.name}: {one.doing}" for one in processes)
            console.redraw(f"[{self._done}/{self._total}] {told}")

    def ended(self, report: CaseReport) -> None:
        from manipcli.report.suite_text import render_line

        self._done += 1
        self.clear()
        if self._quiet and report.passed:
            return
        show = console.result if self._text else console.talk
        show(render_line(report, width=self._width))

    def clear(self) -> None:
        if self._live:
            console.redraw("")


def _tell(suite: Suite, format_: str, *, github: bool) -> None:
    from manipcli.report import suite_json, suite_text
    from manipcli.report.github import render_annotations

    if github and not all(report.passed for report in suite.reports):
        workspace = os.environ.get("GITHUB_WORKSPACE")
        told = render_annotations(suite.reports, workspace=Path(workspace) if workspace else None)
        (console.result if format_ == "text" else console.talk)(told)
    console.result(suite_json.render_suite(suite) if format_ == "json" else suite_text.render_suite(suite))


def _write(suite: Suite, junit: Path | None, report: Path | None) -> list[str]:
    """The files that are asked for; why one is not written: that takes nothing from what is told."""
    from manipcli.core.whole_file import write_whole
    from manipcli.report.suite_junit import render_junit
    from manipcli.report.suite_page import render_page

    files: list[tuple[Path, Callable[[], bytes]]] = []
    if junit is not None:
        files.append((junit, lambda: render_junit(suite)))
    if report is not None:
        files.append((report / "index.html", lambda: render_page(suite, report).encode()))
    unwritten = []
    for path, render in files:
        try:
            if path != junit:
                path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, render())
        except OSError as error:
            unwritten.append(f"not written: {path}: {error.strerror}")
        else:
            console.talk(f"written: {path}")
    return unwritten


def _time(option: str, word: str) -> float:
    """
    Raises:
        InvalidInput: it is no time, or below 0.
    """
    value = seconds(word)
    if value < 0.0:
        message = f"{option} {word}: this is below 0"
        raise InvalidInput([Finding("USE049", message, hint="write '10 min', 90, or 0 for never")])
    return value


def _check_replaced(junit: Path | None) -> None:
    """Before anything is run: no file of the tasks, nor any other that somebody wrote, is replaced by a result.

    Raises:
        InvalidInput: there is a file, which is not JUnit XML.
    """
    if junit is not None and junit.is_file():
        with junit.open("rb") as file:
            head = file.read(4096)
        if head and b"<testsuite" not in head:
            message = f"--junit '{junit}': there is a file that is no JUnit XML; it is not replaced"
            raise InvalidInput([Finding("USE089", message)])


def _check_folder(option: str, folder: Path | None, *, hint: str | None = None) -> None:
    """Before anything is run.

    Raises:
        InvalidInput: a file is where the folder should be, nothing can be written there, or it is `-`.
    """
    if folder is None:
        return
    if str(folder) == "-":
        raise InvalidInput([Finding("USE083", f"{option} '-': expected the name of a folder")])
    there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        message = f"{option} '{folder}': '{there}' is a file; a folder was expected"
        raise InvalidInput([Finding("USE086", message, hint=hint)])
    if not os.access(there, os.W_OK):
        raise InvalidInput([Finding("USE086", f"{option} '{folder}': nothing can be written in '{there}'", hint=hint)])


def _cores() -> int:
    """That this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    else:
        return os.cpu_count() or 1
