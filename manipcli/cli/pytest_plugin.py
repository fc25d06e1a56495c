"""The pytest plugin: it collects task files as tests, and its fixture `run_task` runs a task from a test in Python.

`manipcli test` runs pytest with it, too. Every run of pytest loads it, so it imports nothing of manipcli before it has
a task to run.
"""

from __future__ import annotations

import math
from argparse import ArgumentTypeError
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import pytest

if TYPE_CHECKING:
    from manipcli.batch.job import Job, Settings
    from manipcli.report.run_report import JudgedRun
    from manipcli.report.suite.suite import Case, CaseReport

SUFFIXES = (".yaml", ".yml")
"""The same as in `batch/first_look.py`, which is not imported for any other file."""
MARKS_OF_PYTEST = frozenset(
    {"filterwarnings", "parametrize", "skip", "skipif", "tryfirst", "trylast", "usefixtures", "xfail"}
)
"""Marks with a meaning in pytest itself: a tag with such a name is only a word for `-k`."""

SETTINGS = pytest.StashKey["Settings"]()
"""Settings of all runs, from `manipcli test`."""
_SEEN = pytest.StashKey[dict[Path, Path]]()
"""Collected task files, by their resolved paths."""
_TORN = pytest.StashKey[dict[Path, str]]()
"""Files that look like tasks but are not, each with the reason."""


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("manipcli", "tasks of manipcli")
    group.addoption(
        "--manipcli-samples", type=_count, metavar="N", help="run samples 0 to N-1 of each task that has a `vary:`"
    )
    group.addoption(
        "--manipcli-logs", type=Path, metavar="DIR", help="write logs and pictures to DIR [default: runs/test]"
    )
    group.addoption(
        "--manipcli-timeout",
        type=_limit,
        default=600.0,
        metavar="S",
        help="stop a task after S seconds; 0: never [default: 600]",
    )
    group.addoption(
        "--manipcli-silence",
        type=_limit,
        default=60.0,
        metavar="S",
        help="stop a task after S seconds without progress; 0: never [default: 60]",
    )


def pytest_configure(config: pytest.Config) -> None:
    _register(config, "slow", "takes more than a few seconds")
    _register(config, "engine_NAME", "a task for the engine NAME, as engine_pybullet")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Gives the report of a test of `manipcli test` the line and the time of the task, for JUnit."""
    report = yield
    if isinstance(item, TaskItem) and item.report is not None and call.when == "call" and SETTINGS in item.config.stash:
        done = item.report
        report.duration = done.duration
        places = (trouble.place for trouble in done.troubles)
        lines = (place.line for place in places if place is not None and place.file == done.case.file)
        report.location = (report.location[0], next((line for line in lines if line), done.case.line), item.name)
    return report


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> TaskFile | None:
    """Collects the same files as `manipcli test`.

    A named file needs the top-level key `task`. Other files need a name under `task` and the key `robot`; each is
    collected once, also if several links lead to it.
    """
    if file_path.suffix.lower() not in SUFFIXES:
        return None
    from manipcli.batch.first_look import LEFT_OUT, first_look

    named = parent.session.isinitpath(file_path)
    look = first_look(file_path, named=named)
    if named and look == "other":
        from manipcli.batch.discovery import is_named_task

        look = "task" if is_named_task(file_path) else look
    if look == "other" or not _is_looked_for(file_path, parent.session):
        return None
    stash = parent.config.stash
    if look in LEFT_OUT:
        if any(map(parent.session.isinitpath, file_path.parents)):  # pytest also offers the neighbours of a named file
            stash.setdefault(_TORN, {})[file_path] = LEFT_OUT[look]
        return None
    if stash.setdefault(_SEEN, {}).setdefault(file_path.resolve(), file_path) != file_path and not named:
        return None
    # pytest would name files outside of its root by their last part alone.
    outside = None if file_path.is_relative_to(parent.config.rootpath) else str(file_path)
    return TaskFile.from_parent(parent, path=file_path, nodeid=outside)


def pytest_report_collectionfinish(config: pytest.Config) -> list[str]:
    """Lines about files that look like tasks and are left out."""
    files = config.stash.get(_TORN, {})
    if not files:
        return []
    from manipcli.batch.discovery import shown_path

    return [f"{shown_path(file)} {reason}" for file, reason in files.items()]


class TaskFile(pytest.File):
    """A task file: one test, or one for each sample."""

    def collect(self) -> Iterator[TaskItem]:
        from manipcli.batch.discovery import read_case, samples_of, shown_path, variants_of_case

        written = read_case(self.path, shown=shown_path(self.path))
        settings = self.config.stash.get(SETTINGS, None)
        engines, check_step = ((), False) if settings is None else (settings.engines, settings.check_step)
        for sample in samples_of(written, self.config.getoption("manipcli_samples"), self._named()):
            for case in variants_of_case(sample, engines, check_step=check_step):
                for tag in case.tags:
                    if tag not in MARKS_OF_PYTEST and tag not in _registered(self.config):
                        _register(self.config, tag, "a tag of a task")
                yield TaskItem.from_parent(self, name=case.name, case=case)

    def _named(self) -> set[str]:
        """Names of tests in this file that are given as ids, or that failed last with --last-failed."""
        ids = [*self.config.args]
        if self.config.getoption("lf", default=False) and self.config.cache is not None:
            ids += self.config.cache.get("cache/lastfailed", {})
        files = (self.nodeid, str(self.path))
        split = (id_.partition("::") for id_ in ids)
        return {name for file, _, name in split if file in files or self.config.rootpath / file == self.path}


class TaskItem(pytest.Item):
    """One run of a task, in its own process.

    Attributes:
        report: of the run; where it is known before the test starts, nothing is run.
    """

    def __init__(self, *, name: str, parent: TaskFile, case: Case) -> None:
        # A complete node id: pytest reads `[N]` of a sample as parameters, in its cache, too.
        super().__init__(name, parent, nodeid=f"{parent.nodeid}::{name}")
        self._case = case
        self.report: CaseReport | None = None
        self.extra_keyword_matches.update((case.id, *case.tags))
        for tag in case.tags:
            if tag not in MARKS_OF_PYTEST:
                self.add_marker(tag)

    def runtest(self) -> None:
        """
        Raises:
            TaskFailed: the task did not pass.
        """
        from manipcli.batch.process import run_job
        from manipcli.report.suite.suite_text import judged_lines

        if self.report is None:
            self.report = run_job(self.job)
        if not self.report.passed:
            raise TaskFailed(self.report)
        self.add_report_section("call", "margins", "\n".join(judged_lines(self.report)))

    @property
    def jobs(self) -> tuple[Job, ...]:
        """The runs that this test needs: those of an agreement, or its own."""
        from manipcli.batch.variants import in_engine

        return tuple(in_engine(case, self.job.path, self.job.settings) for case in self._case.runs)

    @property
    def job(self) -> Job:
        from manipcli.batch.discovery import shown_path
        from manipcli.batch.job import FOLDER, Job

        settings = self.config.stash.get(SETTINGS, None)
        if settings is None:
            chosen = self.config.getoption("manipcli_logs") or FOLDER
            settings = _settings(self.config, Path(shown_path(self.config.invocation_params.dir / chosen)))
        return Job(self._case, Path(shown_path(self.path)), settings)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None) -> str:
        """The text of `manipcli test` about the failure, instead of a traceback."""
        if isinstance(excinfo.value, TaskFailed):
            from manipcli.report.suite.suite_text import case_lines, gist

            report = excinfo.value.report
            why = gist(report)
            first = why if why.startswith(report.outcome) else f"{report.outcome}: {why}"
            return "\n".join([first, "", *case_lines(report)])
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, int, str]:
        """File, line counted from 0, and name: pytest reports a skipped test with them."""
        return self.path, self._case.line - 1, self.name


class TaskFailed(Exception):
    """A task did not pass."""

    def __init__(self, report: CaseReport) -> None:
        self.report = report
        super().__init__(report.text)


class RunTask(Protocol):
    """The function that the fixture `run_task` returns."""

    def __call__(
        self, path: Path | str, *, overrides: Sequence[str] = (), seed: int | None = None, sample: int | None = None
    ) -> JudgedRun: ...


@pytest.fixture
def run_task(request: pytest.FixtureRequest, tmp_path: Path) -> RunTask:
    """Runs a task in its own process: `run = run_task("pour.yaml", overrides=["scene.cup.mass=80 g"])`.

    A relative path is searched next to the file of the test, then below the root of pytest. The log is below
    `tmp_path`; `run.log` is its path. A failed task alone does not fail the test: `assert run.passed, run.text` does,
    with the reason. A crash or a hang fails the test, and an invalid file raises `manipcli.InvalidInput`.
    """
    count = 0

    def run(
        path: Path | str, *, overrides: Sequence[str] = (), seed: int | None = None, sample: int | None = None
    ) -> JudgedRun:
        __tracebackhide__ = True
        nonlocal count
        from dataclasses import replace

        from manipcli.batch.discovery import read_case, shown_path
        from manipcli.batch.job import Job
        from manipcli.batch.process import run_job
        from manipcli.core.errors import InvalidInput
        from manipcli.report.run_report import JudgedRun
        from manipcli.report.suite.suite_text import render_case

        beside, below = request.path.parent / path, request.config.rootpath / path
        found = beside if beside.exists() or not below.exists() else below
        case = replace(read_case(found, shown=shown_path(found)), sample=sample)
        settings = replace(
            _settings(request.config, tmp_path / "runs" / str(count)),
            overrides=(overrides,) if isinstance(overrides, str) else tuple(overrides),
            seed=seed,
            keep_logs=True,
        )
        count += 1
        report = run_job(Job(case, Path(shown_path(found)), settings))
        if report.findings:
            raise InvalidInput(report.findings)
        if report.run is None:
            pytest.fail(render_case(report), pytrace=False)
        return JudgedRun.of(report.run, passed=report.passed, text=render_case(report), picture=report.picture)

    return run


def _settings(config: pytest.Config, folder: Path) -> Settings:
    from manipcli.batch.job import Settings, limit

    silence, timeout = config.getoption("manipcli_silence"), config.getoption("manipcli_timeout")
    return Settings(folder=folder, silence=limit(silence), timeout=limit(timeout))


def _is_looked_for(path: Path, session: pytest.Session) -> bool:
    """Whether `manipcli test` would enter the folders between this file and a path that pytest was given."""
    from manipcli.batch.first_look import is_entered

    for place in (path, *path.parents):
        if session.isinitpath(place) or place == session.config.rootpath:
            return True
        if place != path and not is_entered(place):
            return False
    return True


def _count(word: str) -> int:
    if not word.isdecimal() or int(word) == 0:
        raise ArgumentTypeError(f"'{word}' is not an integer of 1 or more")
    return int(word)


def _limit(word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not value >= 0.0:
        raise ArgumentTypeError(f"'{word}' is not a number of seconds (0: never)")
    return value


def _register(config: pytest.Config, name: str, about: str) -> None:
    if name not in _registered(config):
        config.addinivalue_line("markers", f"{name}: {about}")


def _registered(config: pytest.Config) -> set[str]:
    return {line.split(":")[0].split("(")[0].strip() for line in config.getini("markers")}
