"""A sweep: many samples of a task, journalled as they come, until all are there or the rate is known well enough."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from typing import Final

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import escape
from manipcli.sweep.journal import Journal
from manipcli.sweep.local import Backend
from manipcli.sweep.results import SampleResult
from manipcli.sweep.sampling import Sampling
from manipcli.sweep.statistics import Rate

DEFAULT: Final = 100
"""Samples of a sweep without --samples."""
MOST: Final = 100_000
"""Samples of a sweep with --until, without --samples."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a sweep is: `asked` samples, of which `before` come from an earlier part of it."""

    asked: int
    done: int
    passed: int
    before: int
    elapsed: float

    @property
    def rate(self) -> float:
        """Samples per second; 0 before the first."""
        return (self.done - self.before) / self.elapsed if self.elapsed > 0.0 else 0.0

    @property
    def left(self) -> float | None:
        """[s] Time left; None before the first sample."""
        return (self.asked - self.done) / self.rate if self.rate > 0.0 else None


@dataclass(frozen=True, slots=True)
class Sweep:
    """The results of a sweep.

    Attributes:
        sampling: the samples.
        results: sorted by number.
        asked: number of samples asked for: `--samples`, or fewer where `until` was reached.
        stopped: why some are missing; "" if none is.
        duration: [s] wall time of this part of the sweep.
        ran: number of samples run in it; the others come from the journal.
    """

    sampling: Sampling
    results: tuple[SampleResult, ...]
    asked: int
    stopped: str
    duration: float
    ran: int

    @property
    def rate(self) -> Rate:
        """Success rate; whatever did not pass counts as not passed."""
        return Rate(sum(result.passed for result in self.results), len(self.results))

    @property
    def interval(self) -> tuple[float, float] | None:
        """Of the rate, for as many random samples; None for a design whose samples are no estimate of that."""
        return self.rate.interval if self.sampling.design.spreads else None

    @property
    def missing(self) -> tuple[int, ...]:
        """Numbers of the samples that have no result."""
        there = {result.number for result in self.results}
        return tuple(number for number in range(self.asked) if number not in there)


def read_until(text: str) -> float | None:
    """The width of the interval at which a sweep ends, from `width=5%`; None for "".

    Raises:
        InvalidInput: it is not a width.
    """
    if not text:
        return None
    name, _, amount = text.partition("=")
    try:
        width = float(amount.removesuffix("%")) / (100.0 if amount.endswith("%") else 1.0)
    except ValueError:
        width = math.nan
    if name != "width" or not 0.0 < width < 1.0:
        message = f"--until '{escape(text)}' is not a width above 0 and below 100 %"
        raise InvalidInput([Diagnostic("USE186", message, hint="write --until width=5%")])
    return width


def run_sweep(
    sampling: Sampling,
    count: int,
    journal: Journal,
    backend: Backend,
    *,
    width: float | None = None,
    observer: Callable[[Progress, SampleResult | None], None] = lambda progress, result: None,
) -> Sweep:
    """Runs the samples that the journal lacks.

    Args:
        sampling: the samples.
        count: number of samples.
        journal: its results are part of the sweep; new ones are written to it.
        backend: what runs them.
        width: end at the first prefix whose interval is at most this wide.
        observer: called with each new result, and often with None in between.

    Raises:
        SweepStopped, OSError, KeyboardInterrupt: not all samples were run; the journal has those that were.
    """
    began = time.monotonic()
    there = [result.passed for number, result in journal.results.items() if number < count]
    before, passed = len(there), sum(there)
    done = before
    prefix = _Prefix(journal, width)

    def observe(result: SampleResult | None) -> None:
        observer(Progress(count, done, passed, before, time.monotonic() - began), result)

    if prefix.end() is None:
        todo = [number for number in range(count) if number not in journal.results]
        with closing(backend(todo, beat=lambda: observe(None))) as results:
            for result in results:
                journal.add(result)
                done, passed = done + 1, passed + result.passed
                observe(result)
                if prefix.end() is not None:
                    break
    asked = count if (end := prefix.end()) is None else min(end, count)
    swept = collected(sampling, journal, asked, duration=time.monotonic() - began, ran=done - before)
    if not swept.missing:
        journal.finish()
    return swept


def collected(
    sampling: Sampling, journal: Journal, asked: int, *, stopped: str = "", duration: float = 0.0, ran: int = 0
) -> Sweep:
    """The sweep of what is in the journal."""
    results = sorted((each for each in journal.results.values() if each.number < asked), key=lambda r: r.number)
    return Sweep(sampling, tuple(results), asked, stopped, duration, ran)


class _Prefix:
    """Looks for the end of a sweep with a width: the least n for which samples 0 to n-1 are all there and the interval
    of their rate is narrow enough. It depends on results by number, not on the order in which they come."""

    def __init__(self, journal: Journal, width: float | None) -> None:
        self._journal, self._width = journal, width
        self._n = self._passed = 0
        self._end: int | None = None

    def end(self) -> int | None:
        """n; None before."""
        while self._width is not None and self._end is None and self._n in self._journal.results:
            self._passed += self._journal.results[self._n].passed
            self._n += 1
            if Rate(self._passed, self._n).width <= self._width:
                self._end = self._n
        return self._end
