"""`manipcli test [PATH...]`: task files as tests, each run in its own process."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING, Annotated, Self

import typer

from manipcli.cli import console
from manipcli.cli.engine_options import CheckStep, Engines, engine_names
from manipcli.cli.options import AllowOutside, Format, Overrides, PackagePath, Seed, cores, seconds
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

if TYPE_CHECKING:
    from manipcli.cli.task_session import TaskSession
    from manipcli.report.suite.suite import CaseReport, Suite

PERIOD = 0.1
"""[s] between two looks at what is running."""


def test(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[PATH]...", help="Task files or folders [default: .].", show_default=False),
    ] = None,
    *,
    jobs: Annotated[
        int | None, typer.Option("-n", metavar="N", min=1, help="Number of parallel runs [default: number of cores].")
    ] = None,
    keyword: Annotated[
        str, typer.Option("-k", metavar="EXPR", help="Run only tests whose id or tags match: 'pour and not slow'.")
    ] = "",
    last_failed: Annotated[
        bool, typer.Option("--last-failed", "--lf", help="Run only tests that failed last; all if none failed.")
    ] = False,
    samples: Annotated[
        int | None,
        typer.Option("--samples", metavar="N", min=1, help="Run samples 0 to N-1 of each task with a `vary:`."),
    ] = None,
    first: Annotated[bool, typer.Option("--exitfirst", "-x", help="Stop at the first failure.")] = False,
    timeout: Annotated[
        str, typer.Option("--timeout", metavar="T", help="Stop a run that takes longer than T; 0: never.")
    ] = "10 min",
    silence: Annotated[
        str, typer.Option("--silence", metavar="T", help="Stop a run without progress for T; 0: never.")
    ] = "60 s",
    junit: Annotated[Path | None, typer.Option("--junit", metavar="FILE.xml", help="Write JUnit XML.")] = None,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="DIR", help="Write an HTML page for each run, and an index.html.")
    ] = None,
    github: Annotated[
        bool, typer.Option("--github", help="Print annotations for GitHub Actions at the lines that failed.")
    ] = False,
    logs: Annotated[
        Path | None,
        typer.Option("--logs", metavar="DIR", help="Write logs and pictures to DIR [default: runs/test]."),
    ] = None,
    keep_logs: Annotated[bool, typer.Option("--keep-logs", help="Keep the logs of passed runs, too.")] = False,
    collect_only: Annotated[
        bool, typer.Option("--collect-only", "--co", help="List the tests that would run, and run none.")
    ] = False,
    durations: Annotated[
        int | None, typer.Option("--durations", metavar="N", min=0, help="List the N slowest tests; 0: all.")
    ] = None,
    engines: Engines = None,
    check_step: CheckStep = False,
    seed: Seed = None,
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only failures and the summary.")] = False,
) -> ExitCode:
    """Run tasks as tests, each in its own process.

    Tests are the YAML files with a name under the top-level key `task`, and the key `robot`; hidden folders, virtual
    environments, runs, build, dist and node_modules are not entered. Logs and pictures of failed tests go to runs/test.
    Without --set, --seed, --samples, --engines and --check-step, tasks are compared with their baselines, see `bless`.
    """
    from manipcli.cli.interrupts import Interrupts

    with Interrupts():
        from manipcli.batch.job import FOLDER, Settings, limit
        from manipcli.cli.task_session import TaskSession
        from manipcli.report.suite.suite_text import slowest_lines

        settings = Settings(
            overrides=tuple(overrides or ()),
            seed=seed,
            package_path=tuple(package_path or ()),
            allow_outside=allow_outside,
            folder=logs or FOLDER,
            pages=report,
            keep_logs=keep_logs,
            engines=engine_names(engines, check_step=check_step, overrides=tuple(overrides or ())),
            check_step=check_step,
            silence=limit(_time("--silence", silence)),
            timeout=limit(_time("--timeout", timeout)),
        )
        check_outputs(("--junit", junit))
        _check_replaced(junit)
        _check_folder("--report", report)
        _check_folder("--logs", settings.folder, hint=None if logs else "name another folder with --logs DIR")
        places = paths or [Path()]
        with TaskSession(places, settings, keyword=keyword, samples=samples, last_failed=last_failed) as session:
            if collect_only:
                return _listed(session, format_)
            with _Lines(session, text=format_ == "text", quiet=quiet) as lines:
                suite = session.run(at_once=jobs or cores(), ended=lines.ended, first=first)
            unwritten = _write(suite, session, junit, report)
        slowest = slowest_lines(suite, durations) if durations is not None and format_ == "text" else ()
        _show(replace(suite, notes=(*slowest, *suite.notes, *unwritten)), format_, github=github)
        return suite.exit_code or (ExitCode.INTERNAL if unwritten else ExitCode.PASSED)


def _listed(session: TaskSession, format_: str) -> ExitCode:
    """Prints the ids of the tests."""
    from manipcli.report.suite.suite_json import render_tests

    for note in session.notes:
        console.talk(note)
    console.result(render_tests([*session.jobs]) if format_ == "json" else "\n".join([*session.jobs, _count(session)]))
    return ExitCode.PASSED if session.jobs else ExitCode.NOTHING_TO_RUN


def _count(session: TaskSession) -> str:
    from manipcli.core.text import number_of

    return f"{number_of(len(session.jobs), 'test')} in {number_of(len(session.files), 'file')}"


class _Lines:
    """Progress of the tests: a line for each test that ends, and on a terminal the running tests."""

    def __init__(self, session: TaskSession, *, text: bool, quiet: bool) -> None:
        from manipcli.report.suite.suite_text import id_width

        self._session = session
        self._width = id_width([job.case for job in session.jobs.values()])
        self._done = 0
        self._text, self._quiet = text, quiet
        self._lock, self._over = Lock(), Event()
        self._thread = Thread(target=self._watch, daemon=True) if console.is_live() and not quiet else None

    def __enter__(self) -> Self:
        if self._thread is not None:
            self._thread.start()
        return self

    def __exit__(self, *raised: object) -> None:
        self._over.set()
        if self._thread is not None:
            self._thread.join()
            console.redraw("")

    def ended(self, report: CaseReport) -> None:
        from manipcli.report.suite.suite_text import render_line

        with self._lock:
            self._done += 1
            if self._thread is not None:
                console.redraw("")
            if report.passed and self._quiet:
                return
            show = console.result if self._text else console.talk
            show(render_line(report, width=self._width))

    def _watch(self) -> None:
        while not self._over.wait(PERIOD):
            running = (f"{id_.partition('::')[2]}: {activity}" for id_, activity in [*self._session.running.items()])
            with self._lock:
                console.redraw(f"[{self._done}/{len(self._session.jobs)}] {'   '.join(running)}")


def _show(suite: Suite, format_: str, *, github: bool) -> None:
    from manipcli.report.suite import suite_json, suite_text
    from manipcli.report.suite.github import render_annotations

    if github and not all(report.passed for report in suite.reports):
        workspace = os.environ.get("GITHUB_WORKSPACE")
        annotations = render_annotations(suite.reports, workspace=Path(workspace) if workspace else None)
        (console.result if format_ == "text" else console.talk)(annotations)
    console.result(suite_json.render_suite(suite) if format_ == "json" else suite_text.render_suite(suite))


def _write(suite: Suite, session: TaskSession, junit: Path | None, report: Path | None) -> list[str]:
    """Writes the requested files; returns why some could not be written."""
    from manipcli.core.whole_file import write_whole
    from manipcli.report.html.suite_page import render_page

    files: list[tuple[Path, bytes]] = [] if junit is None else [(junit, session.junit)]
    if report is not None:
        files.append((report / "index.html", render_page(suite, report).encode()))
    unwritten = []
    for path, data in files:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, data)
        except OSError as error:
            unwritten.append(f"not written: {path}: {error.strerror}")
        else:
            console.talk(f"written: {path}")
    return unwritten


def _time(option: str, word: str) -> float:
    """
    Raises:
        InvalidInput: it is not a time, or below 0.
    """
    value = seconds(word)
    if value < 0.0:
        message = f"{option} {word} is below 0"
        raise InvalidInput([Diagnostic("USE049", message, hint="write '10 min', 90, or 0 for never")])
    return value


def _check_replaced(junit: Path | None) -> None:
    """Checks before the run that --junit replaces only JUnit XML.

    Raises:
        InvalidInput: the file exists and is not JUnit XML.
    """
    if junit is not None and junit.is_file():
        with junit.open("rb") as file:
            head = file.read(4096)
        if head and b"<testsuite" not in head:
            message = f"--junit '{junit}' exists and is not JUnit XML; it is not replaced"
            raise InvalidInput([Diagnostic("USE089", message)])


def _check_folder(option: str, folder: Path | None, *, hint: str | None = None) -> None:
    """Checks before the run that a folder can be written.

    Raises:
        InvalidInput: a file has its place, it is not writable, or it is `-`.
    """
    if folder is None:
        return
    if str(folder) == "-":
        raise InvalidInput([Diagnostic("USE083", f"{option} '-': expected a folder name")])
    there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        message = f"{option} '{folder}': '{there}' is a file; expected a folder"
        raise InvalidInput([Diagnostic("USE086", message, hint=hint)])
    if not os.access(there, os.W_OK):
        raise InvalidInput([Diagnostic("USE086", f"{option} '{folder}': '{there}' is not writable", hint=hint)])
