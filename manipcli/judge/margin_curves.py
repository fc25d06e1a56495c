"""The margins of expectations over time, as the judge saw them, thinned for a plot."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from manipcli.conditions.robustness import Pick, Robustness
from manipcli.core.geometry import Array
from manipcli.judge.verdict import ExpectationOutcome


@dataclass(frozen=True, slots=True)
class MarginCurve:
    """The margin of one expectation over time.

    Attributes:
        outcome: of the expectation; its `at` and `margin` are the tightest moment.
        unit: SI unit of `margins`; "" if its members have several, and `margins` are then divided by the tolerances.
        times: (T,) [s], increasing.
        margins: (T,) 0 or more where it is met; NaN where it does not apply.
        relative: (T,) the same divided by the tolerances.
        since: [s] margins before this time do not count, such as those before the end of a run.
    """

    outcome: ExpectationOutcome
    unit: str
    times: Array
    margins: Array
    relative: Array
    since: float = -inf


class MarginTrace:
    """Collects the margins of one expectation: of each interval of `width` [s] the deciding one.

    What is collected is as long as the run, not as the recording is dense.
    """

    def __init__(self, width: float) -> None:
        self._width = width
        self._parts: list[tuple[Array, Array, Array]] = []
        self._units: tuple[str, ...] = ()
        self.since = -inf
        """See `MarginCurve`."""

    def add(self, answer: Robustness, times: Array, pick: Pick, first: int = 0, last: int | None = None) -> None:
        """Add the ticks from `first` up to, not including, `last`."""
        times = times[first:last]
        if not len(times):
            return
        self._units = answer.units
        order = np.where(answer.applies & np.isfinite(answer.order), answer.order, np.nan)[first:last]
        value = order if pick == "least" else -order
        interval = np.floor(times / self._width + 1e-6)
        # The first of each interval in this order is the deciding one; NaN comes last.
        ranked = np.lexsort((value, interval))
        kept = ranked[np.flatnonzero(np.diff(interval[ranked], prepend=np.nan) != 0.0)]
        known = np.isfinite(order[kept])
        margins, relative = (np.where(known, of[first:last][kept], np.nan) for of in (answer.margins, answer.relative))
        self._parts.append((times[kept], margins, relative))

    def curve(self, outcome: ExpectationOutcome) -> MarginCurve | None:
        """The curve; None if the margin is that of the whole run, or known at fewer than two times."""
        if not self._parts:
            return None
        times, margins, relative = (np.concatenate(part) for part in zip(*self._parts, strict=True))
        known = margins[np.isfinite(margins)]
        if len(known) < 2 or np.ptp(known) == 0.0:
            return None
        several = len(self._units) > 1
        return MarginCurve(
            outcome, "" if several else self._units[0], times, relative if several else margins, relative, self.since
        )


class MarginTraces:
    """Collects the margins of all expectations of a run; `width` [s]: see `MarginTrace`."""

    def __init__(self, width: float) -> None:
        self._width = width
        self._traces: list[MarginTrace] = []

    def next(self) -> MarginTrace:
        """The trace of the next expectation."""
        self._traces.append(MarginTrace(self._width))
        return self._traces[-1]

    def curves(self, outcomes: tuple[ExpectationOutcome, ...]) -> tuple[MarginCurve, ...]:
        """The curves of the expectations that have one."""
        found = (trace.curve(outcome) for trace, outcome in zip(self._traces, outcomes, strict=False))
        return tuple(curve for curve in found if curve is not None)
