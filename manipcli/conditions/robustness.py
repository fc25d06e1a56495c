"""Margins over successive ticks and their combination: the robust semantics of signal temporal logic.

    all: the least of the members,  any: the greatest,  not: the opposite;  always: the least over time,
    eventually: the greatest over time          (Donze and Maler, Robust satisfaction of temporal logic, 2010)

A margin of 0 is met and its opposite is not, so exactly one of a condition and its `not` holds: for `not`, a margin of
less than `EDGE` counts as `EDGE`.

Margins in one unit are compared directly. Where units differ, for example rad and m, each margin is divided by its
tolerance first; this keeps the signs. The reported margin is that of the deciding member at the deciding tick, in its
own unit.
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
"""The smallest amount by which a condition can fail, in the SI unit of its margin: the opposite of 0 is -EDGE.

The numbers of `--format json` are rounded to this and keep their sign.
"""


@dataclass(frozen=True, slots=True)
class Measured:
    """The deciding measurement.

    Attributes:
        margin: 0 or more passes; in `unit`.
        unit: SI.
        at: when [s]; None if no time applies.
        text: what was measured.
        relative: the margin divided by its tolerance; None before a tick is chosen.
    """

    margin: float
    unit: str
    at: float | None
    text: str = ""
    relative: float | None = None

    @property
    def lacking(self) -> str:
        """` by 3 mm`, the amount by which it fails; "" if it holds or has no unit."""
        return f" by {readable(-self.margin, self.unit)}" if self.unit and self.margin < -EDGE else ""


@dataclass(frozen=True, slots=True)
class NotEvaluated:
    """Why something could not be evaluated; this never counts as a pass.

    `skipped`: it is asked only of steps in a branch that was not taken; this does not count as a failure either.
    """

    reason: str
    unit: str = ""
    skipped: bool = False


@dataclass(frozen=True, slots=True)
class Robustness:
    """Margins on T successive ticks.

    Attributes:
        margins: (T,) 0 or more where the condition holds, each in the unit of the member that decides there.
        relative: (T,) the same divided by the tolerances, without unit.
        units: every unit that can occur, without duplicates.
        applies: (T,) False where the condition is undefined, for example the slip of an object that is not held.
        idle: why it does not apply where `applies` is False.
        found: tick -> the measurement of that tick.
    """

    margins: Array
    relative: Array
    units: tuple[str, ...]
    applies: Mask
    idle: str
    found: Callable[[int], Measured]

    @property
    def order(self) -> Array:
        """(T,) the values by which margins are compared."""
        return self.margins if len(self.units) == 1 else self.relative


def robustness(
    margins: Array,
    times: Array,
    *,
    unit: str,
    scale: float,
    describe: Callable[[int], str],
    at: Callable[[int], float | None] | None = None,
    applies: Mask | None = None,
    idle: str = "",
) -> Robustness:
    """Margins in one unit.

    Args:
        margins: (T,), or a scalar for all ticks.
        times: (T,) [s]
        unit: SI.
        scale: the tolerance of the condition, above 0, in `unit`.
        describe: tick -> text of the measurement.
        at: tick -> the reported time [s]; default: that of the tick.
        applies, idle: see `Robustness`; default: every tick.
    """
    every = np.broadcast_to(margins, np.shape(times))

    def found(k: int) -> Measured:
        margin = float(every[k]) + 0.0  # never -0
        return Measured(margin, unit, float(times[k]) if at is None else at(k), describe(k))

    everywhere = np.ones(np.shape(times), dtype=bool) if applies is None else applies
    return Robustness(every, every / scale, (unit,), everywhere, idle, found)


def least(readings: Sequence[Robustness]) -> Robustness:
    """`all`: the least margin of each tick; it applies where every member applies."""
    return _picked(readings, np.argmin)


def greatest(readings: Sequence[Robustness]) -> Robustness:
    """`any`: the greatest margin of each tick; it applies where every member applies."""
    return _picked(readings, np.argmax)


def nth_greatest(readings: Sequence[Robustness], n: int) -> Robustness:
    """`at_least`: the n-th greatest margin of each tick; NaN if a member has it.

    The text is that of the deciding member, after the number of members that hold.
    """

    def pick(values: Array, *, axis: int) -> npt.NDArray[np.intp]:
        ranked = np.argsort(-values, axis=axis, kind="stable")[n - 1]
        return np.asarray(
            np.where(np.isnan(values).any(axis=axis), np.argmax(values, axis=axis), ranked), dtype=np.intp
        )

    return _counting(_picked(readings, pick), readings)


def _counting(of: Robustness, readings: Sequence[Robustness]) -> Robustness:
    """The same; its texts begin with the number of members that hold."""

    def found(k: int) -> Measured:
        measured = of.found(k)
        holding = sum(bool(reading.margins[k] >= 0.0) for reading in readings)
        return replace(measured, text=f"{holding} of {len(readings)}: {measured.text}")

    return replace(of, found=found)


def opposite(of: Robustness, *, word: str = "not ") -> Robustness:
    """`not`: the negated margin, at most -`EDGE` where `of` holds; `word` is put before the text."""

    def found(k: int) -> Measured:
        measured = of.found(k)
        margin = float(_negated(np.asarray(measured.margin)))
        return replace(measured, margin=margin, text=f"{word}{measured.text}")

    return replace(of, margins=_negated(of.margins), relative=_negated(of.relative), found=found)


def _negated(margins: Array) -> Array:
    # Monotonically decreasing, so that `not` of `all` equals `any` of `not`s.
    return np.where(margins >= 0.0, -np.maximum(margins, EDGE), -margins)


def never(of: Robustness) -> Robustness:
    """`never`: the opposite, with the limit in the text negated: `'cup' moved by 38 mm; never at least 60 mm`.

    `never: {not: X}` reads as `always: X`.
    """
    against = opposite(of, word="")

    def found(k: int) -> Measured:
        measured = against.found(k)
        if measured.text.startswith("not "):
            return replace(measured, text=measured.text.removeprefix("not "))
        value, separator, limit = measured.text.rpartition("; ")
        return replace(measured, text=f"{value}; never {limit}") if separator else measured

    return replace(against, found=found)


def named(of: Robustness, word: str) -> Robustness:
    """The same; its texts begin with `word`, the name of the condition."""

    def found(k: int) -> Measured:
        measured = of.found(k)
        return replace(measured, text=f"{word}: {measured.text}")

    return replace(of, found=found)


def _picked(readings: Sequence[Robustness], pick: Callable[..., npt.NDArray[np.intp]]) -> Robustness:
    # argmin and argmax both pick NaN, so it is not lost.
    if len(readings) == 1:
        return readings[0]
    units = tuple(sorted({unit for reading in readings for unit in reading.units}))
    margins = np.stack([reading.margins for reading in readings])
    relative = np.stack([reading.relative for reading in readings])
    member = pick(margins if len(units) == 1 else relative, axis=0)
    ticks = np.arange(margins.shape[1])
    applies = np.logical_and.reduce([reading.applies for reading in readings])
    idle = next((reading.idle for reading in readings if not reading.applies.all()), "")
    return Robustness(
        margins[member, ticks], relative[member, ticks], units, applies, idle, lambda k: readings[member[k]].found(k)
    )


class Extreme:
    """The least or the greatest margin over time; of equal margins the first."""

    def __init__(self, pick: Pick) -> None:
        self._pick = pick
        self._best: Measured | None = None
        self._order = 0.0
        self._fault: NotEvaluated | None = None
        self._idle = ""
        self.broken: float | None = None
        """The first time [s] at which it failed."""
        self.broken_ticks = 0
        """The number of ticks at which it failed."""

    def add(self, more: Robustness, times: Array, first: int = 0, last: int | None = None) -> None:
        """Add the ticks from `first` up to, not including, `last`."""
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
        """The deciding measurement; None if no tick was added."""
        if self._fault is not None:
            return self._fault
        if self._best is None and self._idle:
            return NotEvaluated(self._idle)
        return self._best
