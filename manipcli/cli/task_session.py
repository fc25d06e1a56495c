"""A pytest session over task files, for `manipcli test` and `bless`.

pytest collects, selects and reports the tests through `cli/pytest_plugin.py`; their processes run in parallel
(`batch/process.py`), and each is reported when it ends. The user's own pytest configuration, conftest files, plugins
and environment variables are ignored, and pytest prints nothing.
"""

from __future__ import annotations

import io
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, redirect_stderr, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, Self

import pytest

from manipcli.batch import process
from manipcli.batch.baseline import is_baseline, kept_baseline
from manipcli.batch.discovery import refused_path, shown_path
from manipcli.batch.first_look import NOT_ENTERED
from manipcli.batch.job import Beat, Job, Settings
from manipcli.batch.variants import agreement_report
from manipcli.cli import console, pytest_plugin
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import number_of
from manipcli.report.suite.suite import CaseReport, Suite

BLOCKED = (
    "terminal", "python", "doctest", "unittest", "faulthandler", "logging", "warnings", "stepwise", "pastebin",
    "unraisableexception", "threadexception",
)  # fmt: skip
"""Plugins of pytest itself that would print, collect other files than tasks, change signal handlers, or collect garbage
several times."""
CACHE = ".cache"
"""Folder below the logs in which pytest remembers which tests failed."""
_INTERNAL_ERROR = pytest.ExitCode.INTERNAL_ERROR
VARIABLES = ("PYTEST_ADDOPTS", "PYTEST_PLUGINS", "PYTEST_DISABLE_PLUGIN_AUTOLOAD")


class TaskSession:
    """The tests below some paths. A context manager: the constructor collects them, `run` runs them.

    Attributes:
        jobs: the runs by the ids of their tests, in the order of collection.
        files: the task files.
        notes: about baselines and unreadable files.
        running: the last heartbeat of each test that is running, by its id.
        junit: the JUnit XML of the last `run`.

    Args:
        paths: files, folders, and ids such as `tasks/pour.yaml::pour[3]`.
        settings: of all runs.
        keyword: an expression of pytest's `-k`; "" for all.
        samples: number of samples of each task with a `vary:`; None for the task as written.
        last_failed: only tests that failed last; all if none failed.

    Raises:
        InvalidInput: a path does not exist or is not a task, or the expression is invalid.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        settings: Settings,
        *,
        keyword: str = "",
        samples: int | None = None,
        last_failed: bool = False,
    ) -> None:
        named = [*{os.path.realpath(path): path for path in reversed(paths)}.values()][::-1]
        files = [Path(str(path).partition("::")[0]) for path in named]
        refused = [finding for file in files if not file.is_dir() for finding in refused_path(file)]
        if refused:
            raise InvalidInput(refused)
        self._settings = settings
        self.running: dict[str, Beat] = {}
        self.junit = b""
        cwd = Path.cwd()
        self._words = [
            "-c", os.devnull, f"--rootdir={cwd}", "--noconftest", "--capture=no", "--continue-on-collection-errors",
            *(word for name in BLOCKED for word in ("-p", f"no:{name}")), "-p", pytest_plugin.__name__,
            "-o", f"norecursedirs=.* {' '.join(sorted(NOT_ENTERED))}",
            "-o", f"cache_dir={cwd / settings.folder / CACHE}",
            "-o", "junit_family=xunit1", "-o", "junit_suite_name=manipcli",
            *([f"--manipcli-samples={samples}"] if samples else []),
            *(["-k", keyword] if keyword else []),
            *(["--last-failed"] if last_failed else []),
            *(str(cwd / path) for path in named),
        ]  # fmt: skip
        found = _Collected(settings)
        messages = io.StringIO()
        with redirect_stderr(messages):
            code = _pytest([*self._words, "--collect-only"], found)
        if code == pytest.ExitCode.USAGE_ERROR:
            message = messages.getvalue().strip().removeprefix("ERROR: ")
            hint = "write, for example, -k 'pour and not (slow or kinematic)'" if "'-k'" in message else None
            raise InvalidInput([Diagnostic("USE085", message, hint=hint)])
        if code == _INTERNAL_ERROR:
            raise RuntimeError(messages.getvalue())
        if found.interrupted:
            raise KeyboardInterrupt
        self.jobs = {item.nodeid: item.job for item in found.chosen}
        self.files = tuple(found.files)
        self.notes = tuple(self._notes(found, keyword))
        for line in found.left_out:
            console.talk(line)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        remove_empty(self._settings.folder)

    def run(self, *, at_once: int, ended: Callable[[CaseReport], None], first: bool = False) -> Suite:
        """Runs the tests.

        Args:
            at_once: number of parallel tests.
            ended: callback for each report, in the order in which the tests end.
            first: stop at the first failure.
        """
        began = time.monotonic()
        at_once = min(at_once, max(1, len(self.jobs)))
        run = _Run(self._settings, at_once, self.running, ended)
        with TemporaryDirectory(prefix="manipcli-test-") as folder:
            junit = Path(folder, "junit.xml")
            if _pytest([*self._words, f"--junitxml={junit}", *(["-x"] if first else [])], run) == _INTERNAL_ERROR:
                raise RuntimeError("pytest ended with an internal error")
            self.junit = junit.read_bytes()
        reports = tuple(run.reports[id_] for id_ in self.jobs if id_ in run.reports)
        undone = tuple(job.case for id_, job in self.jobs.items() if id_ not in run.reports)
        stopped: Literal["", "interrupted", "first failure"] = ""
        if run.interrupted:
            stopped = "interrupted"
        elif undone and first:
            stopped = "first failure"
        interrupted = (f"interrupted: {id_}: {beat}" for id_, beat in self.running.items())
        notes = (*interrupted, *self.notes) if run.interrupted else self.notes
        return Suite(reports, len(self.jobs), at_once, time.monotonic() - began, stopped, notes, undone)

    def _notes(self, found: _Collected, keyword: str) -> Iterator[str]:
        """Notes about baselines, unreadable files and an expression without a match."""
        yield from found.errors
        if keyword and found.total and not found.chosen:
            yield f"-k '{keyword}' matches none of {number_of(found.total, 'test')}"
        owned = {os.path.realpath(kept_baseline(file)) for file in found.files}
        for file in found.baselines:
            if os.path.realpath(file) not in owned and is_baseline(file):
                yield f"{shown_path(file)}: no task has this baseline; rename it after its task, or remove it"
        uncompared = sum(not job.nominal and kept_baseline(job.path).exists() for job in self.jobs.values())
        if uncompared and self._settings.baseline:
            reason = (
                "a baseline is for the task as written, without --set, --seed, --samples, --engines and --check-step"
            )
            yield f"{number_of(uncompared, 'test')} not compared with the baseline: {reason}"


class _Plugin:
    """A plugin that gives the settings of all runs to the tests, and records an interrupt."""

    def __init__(self, settings: Settings) -> None:
        self.interrupted = False
        self._settings = settings

    def pytest_configure(self, config: pytest.Config) -> None:
        config.stash[pytest_plugin.SETTINGS] = self._settings

    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        self.interrupted = excinfo.type is KeyboardInterrupt


class _Collected(_Plugin):
    """A plugin that records what pytest collects."""

    def __init__(self, settings: Settings) -> None:
        super().__init__(settings)
        self.chosen: list[pytest_plugin.TaskItem] = []
        self.total = 0
        self.files: list[Path] = []
        self.baselines: list[Path] = []
        self.errors: list[str] = []
        self.left_out: list[str] = []

    def pytest_collect_file(self, file_path: Path, parent: pytest.Collector) -> None:
        if file_path.name.endswith(".baseline.json") and any(map(parent.session.isinitpath, file_path.parents)):
            self.baselines.append(file_path)

    def pytest_collectstart(self, collector: pytest.Collector) -> None:
        if isinstance(collector, pytest_plugin.TaskFile):
            self.files.append(collector.path)

    def pytest_itemcollected(self, item: pytest.Item) -> None:
        self.total += 1

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.errors.append(f"{report.nodeid} cannot be read: {report.longreprtext.splitlines()[-1]}")

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.chosen = [item for item in session.items if isinstance(item, pytest_plugin.TaskItem)]
        self.left_out = pytest_plugin.pytest_report_collectionfinish(session.config)


class _Run(_Plugin):
    """A plugin that runs the processes of the tests in parallel, and reports each test when its process ends."""

    def __init__(
        self, settings: Settings, at_once: int, running: dict[str, Beat], ended: Callable[[CaseReport], None]
    ) -> None:
        super().__init__(settings)
        self.reports: dict[str, CaseReport] = {}
        self._at_once, self._running, self._ended = at_once, running, ended

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        items = {item.nodeid: item for item in session.items if isinstance(item, pytest_plugin.TaskItem)}
        jobs = {job.case.id: job for item in items.values() for job in item.jobs}
        comparisons = [item for item in items.values() if item.job.case.compared]
        done: dict[str, CaseReport] = {}
        with closing(process.run_jobs(jobs.values(), at_once=self._at_once, observer=self._observe)) as reports:
            for report in reports:
                done[report.case.id] = report
                self._running.pop(report.case.id, None)
                if report.case.id in items:
                    self._finish(session, items[report.case.id], report)
                for item in [*comparisons]:
                    runs = [done.get(job.case.id) for job in item.jobs]
                    known = [run for run in runs if run is not None]
                    if len(known) == len(runs):
                        comparisons.remove(item)
                        self._finish(session, item, agreement_report(item.job, known))
        return True

    def _finish(self, session: pytest.Session, item: pytest_plugin.TaskItem, report: CaseReport) -> None:
        """Reports a test.

        Raises:
            session.Failed: it is the last one.
        """
        item.report = self.reports[item.nodeid] = report
        session.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
        self._ended(report)
        if session.shouldfail:
            raise session.Failed(session.shouldfail)

    def _observe(self, job: Job, beat: Beat) -> None:
        self._running[job.case.id] = beat


def _pytest(words: Sequence[str], plugin: object) -> int:
    with _own_environment():
        return pytest.main([*words], plugins=[plugin])


@contextmanager
def _own_environment() -> Iterator[None]:
    """Hides pytest options and plugins of the user's environment."""
    before = {name: os.environ.pop(name) for name in VARIABLES if name in os.environ}
    os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
    try:
        yield
    finally:
        del os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"]
        os.environ.update(before)


def remove_empty(folder: Path) -> None:
    """Removes `folder` and the folders below it that are empty."""
    for place, _, _ in os.walk(folder, topdown=False):
        with suppress(OSError):
            Path(place).rmdir()
