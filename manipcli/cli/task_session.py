"""A pytest session over task files, for `manipcli test` and `bless`.

pytest finds, selects and runs the tests through `cli/pytest_plugin.py`, pytest-xdist runs them in parallel. The user's
own pytest configuration, conftest files, plugins and environment variables are ignored. pytest prints nothing; a report
of each test arrives here as a `CaseReport`.
"""

from __future__ import annotations

import io
import os
import pickle
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, Self

import pytest

from manipcli.batch.baseline import is_baseline, kept_baseline
from manipcli.batch.discovery import refused_path, shown_path
from manipcli.batch.first_look import NOT_ENTERED
from manipcli.batch.job import Settings
from manipcli.cli import console, pytest_plugin
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import number_of
from manipcli.report.suite.suite import CaseReport, Suite, Trouble

BLOCKED = (
    "terminal", "python", "doctest", "unittest", "faulthandler", "logging", "warnings", "stepwise", "pastebin",
)  # fmt: skip
"""Plugins of pytest itself that would print, collect other files than tasks, or change signal handlers."""
CACHE = ".cache"
"""Folder below the logs in which pytest remembers which tests failed."""
VARIABLES = ("PYTEST_ADDOPTS", "PYTEST_PLUGINS", "PYTEST_DISABLE_PLUGIN_AUTOLOAD")
JUNIT = "junit.xml"


class TaskSession:
    """The tests below some paths. A context manager: the constructor collects them, `run` runs them.

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
        self._temporary = TemporaryDirectory(prefix="manipcli-test-")
        self.folder = Path(self._temporary.name)
        (self.folder / pytest_plugin.SETTINGS).write_bytes(pickle.dumps(settings))
        cwd = Path.cwd()
        self._words = [
            "-c", os.devnull, f"--rootdir={cwd}", "--noconftest", "--capture=no", "--continue-on-collection-errors",
            *(word for name in BLOCKED for word in ("-p", f"no:{name}")), "-p", pytest_plugin.__name__,
            "-o", f"norecursedirs=.* {' '.join(sorted(NOT_ENTERED))}",
            "-o", f"cache_dir={cwd / settings.folder / CACHE}",
            "-o", "junit_family=xunit1", "-o", "junit_suite_name=manipcli",
            f"--manipcli-session={self.folder}",
            *([f"--manipcli-samples={samples}"] if samples else []),
            *(["-k", keyword] if keyword else []),
            *(["--last-failed"] if last_failed else []),
            *(str(cwd / path) for path in named),
        ]  # fmt: skip
        found = _Collected()
        messages = io.StringIO()
        with redirect_stderr(messages):
            code = _pytest([*self._words, "--collect-only"], found)
        if code == pytest.ExitCode.USAGE_ERROR:
            message = messages.getvalue().strip().removeprefix("ERROR: ")
            hint = "write, for example, -k 'pour and not (slow or kinematic)'" if "'-k'" in message else None
            raise InvalidInput([Diagnostic("USE085", message, hint=hint)])
        if code == pytest.ExitCode.INTERNAL_ERROR:
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
        self._temporary.cleanup()
        remove_empty(self._settings.folder)

    @property
    def running(self) -> list[tuple[str, str]]:
        """Id and progress of each test that is running."""
        texts = [file.read_text("utf-8") for file in self.folder.glob(f"*{pytest_plugin.PROGRESS}")]
        return [(id_, activity) for id_, found, activity in (text.partition("\n") for text in texts) if found]

    @property
    def junit(self) -> bytes:
        """The JUnit XML of the run."""
        return (self.folder / JUNIT).read_bytes()

    def run(self, *, at_once: int, ended: Callable[[CaseReport], None], first: bool = False) -> Suite:
        """Runs the tests.

        Args:
            at_once: number of parallel tests.
            ended: callback for each report, in the order in which the tests end.
            first: stop at the first failure.
        """
        began = time.monotonic()
        run = _Run(self, ended, first=first)
        at_once = min(at_once, max(1, len(self.jobs)))
        words = [*self._words, f"--junitxml={self.folder / JUNIT}", *(["-x"] if first else [])]
        if at_once > 1:  # a worker that ends because of `-x` is not replaced
            words += ["-p", "xdist.plugin", "-n", str(at_once), "--maxschedchunk=1"]
            words += ["--max-worker-restart=0"] if first else []
        if _pytest(words, run) == pytest.ExitCode.INTERNAL_ERROR:
            raise RuntimeError("pytest ended with an internal error")
        reports = tuple(run.reports[id_] for id_ in self.jobs if id_ in run.reports)
        undone = tuple(job.case for id_, job in self.jobs.items() if id_ not in run.reports)
        stopped: Literal["", "interrupted", "first failure"] = ""
        if run.interrupted:
            stopped = "interrupted"
        elif undone and first:
            stopped = "first failure"
        notes = (*run.notes, *self.notes)
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
            reason = "a baseline is for the task as written, without --set, --seed and --samples"
            yield f"{number_of(uncompared, 'test')} not compared with the baseline: {reason}"


class _Collected:
    """A plugin that records what pytest collects."""

    def __init__(self) -> None:
        self.chosen: list[pytest_plugin.TaskItem] = []
        self.total = 0
        self.files: list[Path] = []
        self.baselines: list[Path] = []
        self.errors: list[str] = []
        self.left_out: list[str] = []
        self.interrupted = False

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

    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        self.interrupted = excinfo.type is KeyboardInterrupt


class _Run:
    """A plugin that records the reports of the tests."""

    def __init__(self, session: TaskSession, ended: Callable[[CaseReport], None], *, first: bool) -> None:
        self.reports: dict[str, CaseReport] = {}
        self.notes: list[str] = []
        self.interrupted = False
        self._session, self._ended, self._first = session, ended, first
        self._stopped = False

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        known = getattr(report, pytest_plugin.REPORT, None)
        if self._stopped or (known is None and not report.failed):
            return
        if known is not None:
            done: CaseReport = pickle.loads(known)
        else:  # the worker died, or has a bug
            job = self._session.jobs[report.nodeid]
            text = report.longreprtext
            done = CaseReport(job.case, "error", report.duration, job.command(), text, troubles=(Trouble(text),))
        self.reports[report.nodeid] = done
        self._ended(done)
        if self._first and not done.passed:
            self._stop()

    def pytest_keyboard_interrupt(self, excinfo: pytest.ExceptionInfo[BaseException]) -> None:
        if excinfo.type is KeyboardInterrupt:
            self.interrupted = True
            self.notes += [f"interrupted: {id_}: {activity}" for id_, activity in self._session.running]

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self) -> None:
        if self.interrupted:
            self._stop()

    def _stop(self) -> None:
        """Interrupts the workers; each removes the files of its run."""
        self._stopped = True
        for file in self._session.folder.glob(f"*{pytest_plugin.PROGRESS}"):
            worker = int(file.stem)
            if worker != os.getpid():
                with suppress(ProcessLookupError):
                    os.kill(worker, signal.SIGINT)


def _pytest(words: Sequence[str], plugin: object) -> int:
    with _own_environment():
        return pytest.main([*words], plugins=[plugin])


@contextmanager
def _own_environment() -> Iterator[None]:
    """Hides pytest options and plugins of the user's environment, here and in the workers."""
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
