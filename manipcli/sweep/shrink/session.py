"""A whole search: the samples, the task as written, the smallest changes, and their files run as files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from manipcli.batch.discovery import read_case, shown_path
from manipcli.batch.forks import ForkPool
from manipcli.batch.job import Job, Settings
from manipcli.sweep.local import local_backend
from manipcli.sweep.results import SampleResult, result_of
from manipcli.sweep.sampling import Sampling
from manipcli.sweep.shrink.runs import Runs, State, reports
from manipcli.sweep.shrink.shrink import COUNTS, Smallest, Start, known_results, shrink, start_of
from manipcli.sweep.shrink.space import Space
from manipcli.sweep.shrink.trial import Trial


@dataclass(frozen=True, slots=True)
class Wish:
    """What to search for.

    Attributes:
        sample: number of the sample to begin with; None: those of `samples` that fail.
        samples: number of samples among which failures are looked for.
        budget: number of runs.
        every_way: one change for each way of failing, with a budget for each.
        refused: also count tasks that are refused.
    """

    sample: int | None = None
    samples: int = 20
    budget: int = 100
    every_way: bool = False
    refused: bool = False


@dataclass(frozen=True, slots=True)
class Found:
    """The result of a search.

    Attributes:
        written: the run of the task as written.
        smallest: the changes, the nearest first; empty if nothing fails, or the task fails as written.
        sample: number of the sample of which the changes are.
        outcomes: of all runs with a change.
        done: number of runs.
    """

    written: Trial
    smallest: tuple[Smallest, ...]
    sample: int
    outcomes: tuple[str, ...]
    done: int


def search(
    sampling: Sampling,
    space: Space,
    wish: Wish,
    settings: Settings,
    *,
    at_once: int,
    sweeps: Path,
    observer: Callable[[State], None],
    found: Callable[[Smallest, int], None],
) -> Found:
    """Searches for the smallest change of a task under which it fails.

    Args:
        sampling: the samples of the task.
        space: its coordinates.
        wish: what to search for.
        settings: of the runs; in its folder, logs are written and removed.
        at_once: number of parallel runs; it does not change the result.
        sweeps: folder of the journals of sweeps of random samples.
        observer: called often.
        found: called with a change and its sample when its search ends, also by an exception.

    Raises:
        SweepStopped, RunStopped, OSError, KeyboardInterrupt: the search ended before.
    """
    path = sampling.written.path
    pool = ForkPool([sampling.job(0)] * max(wish.samples, 2))
    pool.open()
    try:
        if wish.sample is not None:
            point, ran = space.sample(wish.sample), 0
            beliefs = any(spec.known is not None for spec in sampling.written.task.spec.scene.values())
            start = Start(wish.sample if beliefs else 0, (point,), (point.x,))
        else:
            results, ran = _samples(sampling, wish, pool, at_once=at_once, sweeps=sweeps, observer=observer)
            start = start_of(sampling, space, results, refused=wish.refused)
        runs = Runs(
            path, settings, space, sample=start.sample, done=ran, budget=wish.budget, at_once=at_once,
            folder=settings.folder, observer=observer, pool=pool,
        )  # fmt: skip
        (written,) = runs([space.origin], "running the task as written")
        smallest: tuple[Smallest, ...] = ()
        if written.outcome == "passed":
            smallest = shrink(
                space,
                runs,
                start,
                seed=sampling.seed,
                counts=COUNTS | {"refused"} if wish.refused else COUNTS,
                every_way=wish.every_way,
                found=lambda each: found(each, start.sample),
            )
    finally:
        pool.close()
    outcomes = tuple(trial.outcome for trial in runs.trials.values() if trial is not written)
    return Found(written, smallest, start.sample, outcomes, runs.done)


def _samples(
    sampling: Sampling,
    wish: Wish,
    pool: ForkPool,
    *,
    at_once: int,
    sweeps: Path,
    observer: Callable[[State], None],
) -> tuple[Sequence[SampleResult], int]:
    """The results of the first samples by number, and how many of them were run for it."""
    known = known_results(sampling, sweeps)
    numbers = range(wish.samples)
    found = {number: known[number] for number in numbers if number in known}
    todo = [number for number in numbers if number not in found]
    ran = 0

    def beat() -> None:
        observer(State("running samples", ran, wish.budget))

    with closing(local_backend(sampling.job, at_once=at_once, pool=pool)(todo, beat=beat)) as results:
        for result in results:
            found[result.number] = result
            ran += 1
            beat()
    return [found[number] for number in numbers], ran


def same_as_file(file: Path, trial: Trial, settings: Settings) -> bool:
    """Whether a written file, run as a task, gives the result of a trial: the same outcome, cause and margins.

    Raises:
        RunStopped: it could not be run.
    """
    job = Job(read_case(file, shown=shown_path(file)), file, settings)
    ((_, report),) = reports([job], at_once=1, beat=lambda: None, pool=None)
    number = trial.result.number
    again = result_of(replace(report, case=replace(report.case, sample=number)))
    return replace(again, cause="") == replace(trial.result, cause="")
