"""The search of `manipcli shrink`: from failing samples, or outward, to the smallest change."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from manipcli.core.errors import InvalidInput
from manipcli.sweep.journal import changes, identity, read_journal
from manipcli.sweep.results import SampleResult
from manipcli.sweep.sampling import Sampling
from manipcli.sweep.shrink.runs import Runs
from manipcli.sweep.shrink.search import Search
from manipcli.sweep.shrink.space import Point, Space
from manipcli.sweep.shrink.trial import Outcome, Spent, Trial, Way

CONFIRMING: Final = 10
"""Runs of the budget that are left for the last bisection and the run at 0.9 of the distance."""

COUNTS: Final[frozenset[Outcome]] = frozenset({"failed"})
"""Outcomes that count as failing."""
MOST_WAYS: Final = 12
"""Failing samples among which `every_way` looks for ways of failing."""


@dataclass(frozen=True, slots=True)
class Smallest:
    """The smallest change that was found.

    Attributes:
        trial: the run that fails.
        nearer: the run at 0.9 of its distance, which does not fail; None where the search ended before.
        way: the way of failing that was searched for; None: any.
    """

    trial: Trial
    nearer: Trial | None
    way: Way | None = None

    @property
    def confirmed(self) -> bool:
        """Whether 0.9 of it was run and passes, or, for a way of failing, fails in another."""
        return self.nearer is not None and (
            self.nearer.outcome == "passed" or (self.way is not None and self.nearer.outcome == "failed")
        )


@dataclass(frozen=True, slots=True)
class Start:
    """Where a search begins.

    Attributes:
        sample: number of the sample from which beliefs of the robot are drawn.
        points: failing samples, the nearest first, the nearest of each way of failing before the others.
        directions: to go outward if there are none, the most promising first.
    """

    sample: int
    points: tuple[Point, ...]
    directions: tuple[tuple[float, ...], ...]


def known_results(sampling: Sampling, folder: Path) -> Mapping[int, SampleResult]:
    """The results of a sweep of the same samples, from its journal; empty if it is of another task or version.

    Args:
        sampling: the samples.
        folder: of the journals of sweeps.
    """
    job = sampling.job(0)
    path = replace(job, settings=replace(job.settings, folder=folder)).log.with_name(f"{job.path.stem}.jsonl")
    with suppress(OSError, InvalidInput):
        read, _ = read_journal(path)
        if not changes(read.whose, identity(sampling.written)):
            return {result.number: result for result in read.results}
    return {}


def start_of(sampling: Sampling, space: Space, results: Sequence[SampleResult], *, refused: bool) -> Start:
    """Where the search begins after these samples.

    Args:
        sampling: the samples.
        space: the coordinates.
        results: of the samples.
        refused: whether a task that is refused counts as failing.
    """
    failing = [each for each in results if each.outcome == "failed" and (refused or each.simulated)]
    failing += [each for each in results if refused and each.outcome == "invalid"]
    points = {each.number: space.sample(each.number) for each in results}
    failing.sort(key=lambda each: (points[each.number].distance, each.number))
    beliefs = any(spec.known is not None for spec in sampling.written.task.spec.scene.values())
    sample = failing[0].number if beliefs and failing else 0
    starts = failing[:1] if beliefs else failing
    nearest = {(each.step, each.broken): each for each in reversed(starts)}.values()
    starts.sort(key=lambda each: not any(each is one for one in nearest))
    worst = sorted((each for each in results if each.passed), key=lambda each: (each.smallest, each.number))
    return Start(
        sample, tuple(points[each.number] for each in starts), tuple(points[each.number].x for each in worst[:2])
    )


def shrink(
    space: Space,
    runs: Runs,
    start: Start,
    *,
    seed: int,
    counts: frozenset[Outcome] = COUNTS,
    every_way: bool = False,
    found: Callable[[Smallest], None] = lambda smallest: None,
) -> tuple[Smallest, ...]:
    """Searches for the smallest change.

    Args:
        space: the coordinates.
        runs: runs the task; with `every_way`, its budget holds for each way of failing.
        start: where to begin.
        seed: of the directions that are tried.
        counts: outcomes that count as failing.
        every_way: also search for the smallest change of each way of failing that was seen.
        found: called with each nearer failure that is found, so that an interrupt loses nothing.

    Returns:
        The smallest change, the nearest first; empty where nothing fails. With `every_way`, one per way of failing.
    """
    budget = runs.budget - runs.done

    def fails(trial: Trial) -> bool:
        return trial.outcome in counts

    if every_way:
        with suppress(Spent):
            runs(start.points[:MOST_WAYS], "starting")
    first = _searched(Search(space, runs, fails, seed=seed), runs, start, None, found)
    if first is None or not every_way:
        return () if first is None else (first,)
    ways = {first.trial.way: replace(first, way=first.trial.way)}
    while (way := next(_unsearched(runs, fails, ways), None)) is not None:
        runs.budget = runs.done + budget
        points = sorted(
            (trial.point for trial in runs.trials.values() if fails(trial) and trial.way == way),
            key=lambda point: point.distance,
        )
        # mypy has no type for a lambda whose argument has a default.
        search = Search(space, runs, lambda trial, way=way: fails(trial) and trial.way == way, seed=seed)  # type: ignore[misc]
        smallest = _searched(search, runs, replace(start, points=tuple(points)), way, found)
        assert smallest is not None
        ways[way] = smallest
    return tuple(sorted(ways.values(), key=lambda smallest: smallest.trial.point.distance))


def _unsearched(runs: Runs, fails: Callable[[Trial], bool], ways: Mapping[Way, Smallest]) -> Iterator[Way]:
    """The ways of failing that were seen and not searched for, in the order of the trials."""
    return (trial.way for trial in runs.trials.values() if fails(trial) and trial.way not in ways)


def _searched(
    search: Search, runs: Runs, start: Start, way: Way | None, found: Callable[[Smallest], None]
) -> Smallest | None:
    """The nearest failing trial of a search, confirmed where the budget suffices."""
    nearer: Trial | None = None
    runs.reserved = min(CONFIRMING, (runs.budget - runs.done) // 3)
    try:
        with suppress(Spent):
            search.nearest(start.points)
            if search.best is None:
                search.nearest(search.outward(start.directions))
        runs.reserved = 0
        search.consider([*runs.trials.values()])  # also those of a batch that the budget cut
        with suppress(Spent):
            nearer = search.confirmed()
    finally:
        search.consider([*runs.trials.values()])
        if search.best is not None:
            found(Smallest(search.best, nearer, way))
    return None if search.best is None else Smallest(search.best, nearer, way)
