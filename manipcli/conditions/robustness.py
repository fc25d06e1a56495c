"""Margins over successive ticks, and how they combine: the robust semantics of signal temporal logic.

    all: the least of the members,  any: the greatest,  not: the opposite;  always: the least over time,
    eventually: the greatest over time          (Donze and Maler, Robust satisfaction of temporal logic, 2010)

A margin of 0 is met; its opposite is not, so that of a condition and its `not` exactly one holds: what is met by less
than `EDGE` counts there as met by that.

Margins in one unit compare as they are. Where units differ, as a tilt's and a distance's do, margins compare by
themselves over the tolerance that each was compared to; signs come first in either order. What is told is the margin of
the deciding member at the deciding moment, in its own unit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.core.units import readable

Mask = npt.NDArray[np.bool_]
Pick = Literal["least", "greatest"]

EDGE: Final = 1e-9
"""Least amount, in the SI unit of a margin, by which a condition is missed: the opposite of 0 is minus this.

The numbers of `--format json` are rounded to as much, and keep their sign.
"""


@dataclass(frozen=True, slots=True)
class Measured:
    """What was found: the deciding `margin` (>= 0 passes) in `unit`, when [s], and about what; `relative`: the margin
    over its tolerance, once it is that of a time."""

    margin: float
    unit: str
    at: float | None
    text: str = ""
    relative: float | None = None

    @property
    def lacking(self) -> str:
        """` by 3 mm`, how far it is from holding; "" where there is nothing to tell."""
        return f" by {readable(-self.margin, self.unit)}" if self.unit and self.margin < -EDGE else ""


@dataclass(frozen=True, slots=True)
class NotEvaluated:
    """Why something could not be judged; that is never a pass."""

    reason: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Robustness:
    """Margins on T successive ticks.

    Attributes:
        margins: (T,) positive where the condition holds, each in the unit of the member that decides there.
        relative: (T,) the same over the tolerances, without unit.
        units: all that can occur, each once.
        applies: (T,) where there is anything to say: of an object that no hand holds, there is no slip.
        idle: why it does not apply, where it does not.
        found: tick -> what to tell of it.
    """

    margins: Array
    relative: Array
    units: tuple[str, ...]
    applies: Mask
    idle: str
    found: Callable[[int], Measured]

    @property
    def order(self) -> Array:
        """(T,) by which margins compare."""
        return self.margins if len(self.units) == 1 else self.relative


def robustness(
    margins: Array,
    times: Array,
    *,
    unit: str,
    scale: float,
    say: Callable[[int], str],
    at: Callable[[int], float | None] | None = None,
    applies: Mask | None = None,
    idle: str = "",
) -> Robustness:
    """Margins in one unit.

    Args:
        margins: (T,), or one for all ticks.
        times: (T,) [s]
        unit: SI.
        scale: the tolerance that they were compared to, above 0, in `unit`.
        say: tick -> what was measured there.
        at: tick -> the moment [s] to name; default: the tick's own.
        applies, idle: see `Robustness`; default: everywhere.
    """
    every = np.broadcast_to(margins, np.shape(times))

    def found(k: int) -> Measured:
        margin = float(every[k]) + 0.0  # never -0
        return Measured(margin, unit, float(times[k]) if at is None else at(k), say(k))

    everywhere = np.ones(np.shape(times), dtype=bool) if applies is None else applies
    return Robustness(every, every / scale, (unit,), everywhere, idle, found)


def least(readings: Sequence[Robustness]) -> Robustness:
    """`all`: on each tick the least margin; it applies where every member does."""
    return _picked(readings, np.argmin)


def greatest(readings: Sequence[Robustness]) -> Robustness:
    """`any`: on each tick the greatest margin; it applies where every member does."""
    return _picked(readings, np.argmax)


def opposite(of: Robustness, *, word: str = "not ") -> Robustness:
    """`not`: the same margin with the other sign, and -`EDGE` at most where `of` holds; `word` is said before what was
    found."""

    def found(k: int) -> Measured:
        one = of.found(k)
        return replace(one, margin=float(_negated(np.asarray(one.margin))), text=f"{word}{one.text}")

    return replace(of, margins=_negated(of.margins), relative=_negated(of.relative), found=found)


def _negated(margins: Array) -> Array:
    # Never rising, so that `not` of `all` stays `any` of `not`s.
    return np.where(margins >= 0.0, -np.maximum(margins, EDGE), -margins)


def never(of: Robustness) -> Robustness:
    """`never`: the opposite, and what is asked is told as such: `'cup' moved by 38 mm; never at least 60 mm`.

    Never not is always.
    """
    against = opposite(of, word="")

    def found(k: int) -> Measured:
        one = against.found(k)
        if one.text.startswith("not "):
            return replace(one, text=one.text.removeprefix("not "))
        measured, between, asked = one.text.rpartition("; ")
        return replace(one, text=f"{measured}; never {asked}") if between else one

    return replace(against, found=found)


def named(of: Robustness, word: str) -> Robustness:
    """The same, telling which condition it is."""

    def found(k: int) -> Measured:
        one = of.found(k)
        return replace(one, text=f"{word}: {one.text}")

    return replace(of, found=found)


def _picked(readings: Sequence[Robustness], pick: Callable[..., npt.NDArray[np.intp]]) -> Robustness:
    # argmin and argmax both pick what is not a number, so that it is not lost.
    if len(readings) == 1:
        return readings[0]
    units = tuple(sorted({unit for one in readings for unit in one.units}))
    margins = np.stack([one.margins for one in readings])
    relative = np.stack([one.relative for one in readings])
    member = pick(margins if len(units) == 1 else relative, axis=0)
    ticks = np.arange(margins.shape[1])
    applies = np.logical_and.reduce([one.applies for one in readings])
    idle = next((one.idle for one in readings if not one.applies.all()), "")
    return Robustness(
        margins[member, ticks], relative[member, ticks], units, applies, idle, lambda k: readings[member[k]].found(k)
    )


class Extreme:
    """The least or the greatest of readings over time, the first of equal ones."""

    def __init__(self, pick: Pick) -> None:
        self._pick = pick
        self._best: Measured | None = None
        self._order = 0.0
        self._fault: NotEvaluated | None = None
        self._idle = ""
        self.broken: float | None = None
        """The first moment [s] that counts at which it did not hold."""
        self.broken_ticks = 0
        """At how many ticks it did not."""

    def add(self, more: Robustness, times: Array, first: int = 0, last: int | None = None) -> None:
        """The ticks from `first` up to and without `last` count, too."""
        order, applies = more.order[first:last], more.applies[first:last]
        ticks = np.flatnonzero(applies)
        if len(ticks) < len(applies):
            self._idle = more.idle
        if not len(ticks) or self._fault is not None:
            return
        order = order[ticks]
        if not np.isfinite(order).all():
            at = float(times[first + ticks[int(np.argmin(np.isfinite(order)))]])
            unit = more.units[0] if len(more.units) == 1 else ""
            self._fault = NotEvaluated(f"the recorded state is not finite at t = {at:.3f} s", unit)
            return
        failing = first + ticks[order < 0.0]
        if len(failing):
            self.broken_ticks += len(failing)
            if self.broken is None:
                self.broken = float(times[failing[0]])
        k = int(np.argmin(order) if self._pick == "least" else np.argmax(order))
        value = float(order[k])
        if self._best is None or (value < self._order if self._pick == "least" else value > self._order):
            tick = first + int(ticks[k])
            self._best, self._order = replace(more.found(tick), relative=float(more.relative[tick])), value

    @property
    def found(self) -> Measured | NotEvaluated | None:
        """What decides; None while nothing was looked at."""
        if self._fault is not None:
            return self._fault
        if self._best is None and self._idle:
            return NotEvaluated(self._idle)
        return self._best
