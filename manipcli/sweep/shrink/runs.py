"""Runs of a task at points, each in a process of its own, and none of them twice."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from manipcli.batch.discovery import read_case, shown_path
from manipcli.batch.forks import ForkPool
from manipcli.batch.job import Job, Settings
from manipcli.batch.process import run_jobs
from manipcli.core.errors import Diagnostic, ManipcliError
from manipcli.report.suite.suite import CaseReport
from manipcli.sweep.results import result_of
from manipcli.sweep.shrink.space import Point, Space
from manipcli.sweep.shrink.trial import Outcome, Spent, Trial


class RunStopped(ManipcliError):
    """A run could not be done for a reason other than the task: a full disk."""

    code = "RUN106"

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return (Diagnostic(self.code, f"a run was not done: {self}", hint="remove the cause, then start again"),)


@dataclass(frozen=True, slots=True)
class State:
    """How far a search is: `done` runs of at most `budget`; `nearest`: distance of the nearest failure, if any."""

    doing: str
    done: int
    budget: int
    nearest: float | None = None


class Runs:
    """Runs a task at points.

    Attributes:
        done: number of runs so far.
        budget: number of runs.
        reserved: runs of the budget that are kept for later.
        trials: all of them, by point, in the order in which they were asked for.
    """

    def __init__(
        self,
        path: Path,
        settings: Settings,
        space: Space,
        *,
        sample: int,
        done: int = 0,
        budget: int,
        at_once: int,
        folder: Path,
        observer: Callable[[State], None],
        pool: ForkPool | None = None,
    ) -> None:
        """
        Args:
            path: the task file.
            settings: of its runs.
            space: its coordinates.
            sample: number of the sample from which beliefs of the robot are drawn.
            done: number of runs before the first.
            budget: number of runs with these.
            at_once: number of parallel runs.
            folder: for logs, each of which is removed after its run.
            observer: called often.
            pool: forks the processes.
        """
        self.done = done
        self.budget = budget
        self.reserved = 0
        self.trials: dict[Point, Trial] = {}
        self._case = replace(read_case(path, shown=shown_path(path)), sample=sample)
        self._path, self._settings, self._space = path, settings, space
        self._at_once, self._folder, self._observer, self._pool = at_once, folder, observer, pool

    def __call__(self, points: Sequence[Point], doing: str) -> list[Trial]:
        """See `Evaluate`.

        Raises:
            Spent: the budget does not suffice; what it suffices for was run.
            RunStopped: a run could not be done.
        """
        asked = [point for point in dict.fromkeys(points) if point not in self.trials]
        new = asked[: max(0, self.budget - self.reserved - self.done)]
        found = self._run(new, doing)
        self.trials |= {point: found[point] for point in new}
        if len(new) < len(asked):
            raise Spent
        return [self.trials[point] for point in points]

    def _run(self, points: Sequence[Point], doing: str) -> dict[Point, Trial]:
        """Runs new points, in any order."""
        jobs = [self._job(point, self._folder / str(k)) for k, point in enumerate(points)]
        found: dict[Point, Trial] = {}  # in the order in which they end

        def observe() -> None:
            failing = [trial.point.distance for trial in self.trials.values() if trial.outcome == "failed"]
            self._observer(State(doing, self.done, self.budget, min(failing, default=None)))

        observe()
        try:
            for k, report in reports(jobs, at_once=self._at_once, beat=observe, pool=self._pool):
                found[points[k]] = Trial(points[k], outcome_of(report), result_of(report))
                self.done += 1
                observe()
        except BaseException:  # an interrupt, too: no run is lost
            self.trials |= found
            raise
        return found

    def _job(self, point: Point, folder: Path) -> Job:
        overrides = (*self._settings.overrides, self._space.override(point))
        return Job(replace(self._case), self._path, replace(self._settings, overrides=overrides, folder=folder))


def reports(
    jobs: Sequence[Job], *, at_once: int, beat: Callable[[], None], pool: ForkPool | None
) -> Generator[tuple[int, CaseReport], None, None]:
    """Runs jobs, each with a case and a folder of its own, and yields their indices and reports; logs are removed."""
    with closing(run_jobs(jobs, at_once=at_once, observer=lambda job, heard: beat(), pool=pool)) as done:
        for report in done:
            k = next(k for k, job in enumerate(jobs) if job.case is report.case)
            for path in (report.log, report.output):
                if path is not None:
                    Path(path).unlink(missing_ok=True)
            yield k, report


@contextmanager
def scratch(folder: Path) -> Iterator[Path]:
    """A temporary folder below `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix="run-", dir=folder) as name:
        yield Path(name)


_UNFINISHED: Final = ("crashed", "hung", "error")


def outcome_of(report: CaseReport) -> Outcome:
    """What came of a run.

    Raises:
        RunStopped: it could not be done: there is no verdict, and the task is not the reason.
    """
    if report.outcome == "error" and report.run is None:
        raise RunStopped(report.text)
    if report.outcome in _UNFINISHED:
        return "crashed"
    if report.outcome == "passed":
        return "passed"
    ran = report.run is not None and report.run.verdict.simulated_time > 0.0
    return "failed" if ran else "refused"
