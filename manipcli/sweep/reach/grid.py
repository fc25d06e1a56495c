"""The points of a map: values of x, y and yaw, from ranges such as `50 cm:1 m:11` or from a spacing."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import escape
from manipcli.core.units import ANGLE, LENGTH, Dimension, UnitError, to_si

USUAL: Final = 400
"""Most points of a map whose spacing is not given."""
MOST: Final = 20_000
"""Most points of a map."""
_STEPS: Final = (1.0, 2.0, 2.5, 5.0)
_UNIT: Final = re.compile(r"[\d.]\s*([a-z°]+)\s*$")
_EXAMPLES: Final = {LENGTH: "write '50 cm:1 m:11', 50 cm:1 m, or 0.5", ANGLE: "write '0 deg:180 deg:7' or '90 deg'"}


@dataclass(frozen=True, slots=True)
class Range:
    """From `low` to `high` in `count` values; None: as the spacing gives."""

    low: float
    high: float
    count: int | None


@dataclass(frozen=True, slots=True)
class Grid:
    """The values of x, y [m] and yaw [rad] of a map; no yaw: that of the file.

    Points are numbered along x first, then y, then yaw.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    yaw: tuple[float, ...] = ()

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.x) * len(self.y) * max(1, len(self.yaw))

    def point(self, number: int) -> tuple[float, float, float | None]:
        """x, y, yaw of a point."""
        rest, k = divmod(number, len(self.x))
        turn, j = divmod(rest, len(self.y))
        return self.x[k], self.y[j], self.yaw[turn] if self.yaw else None

    def cell(self, number: int) -> tuple[int, int]:
        """Row of y and column of x of a point."""
        rest, k = divmod(number, len(self.x))
        return rest % len(self.y), k

    def order(self) -> Iterator[int]:
        """All points, scattered: an interrupted map is one of all places, and the time left is soon known."""
        return iter(np.random.default_rng(0).permutation(self.count).tolist())


def read_range(option: str, text: str, dimension: Dimension) -> Range:
    """`LOW:HIGH:N`, `LOW:HIGH` or one value, in SI or with units; a bound without a unit has that of the other.

    Raises:
        InvalidInput: it is not a range.
    """
    words = text.split(":")
    try:
        bounds = [_value(word, words[1:2], dimension) for word in words[:2]]
        count = int(words[2]) if len(words) == 3 else None
        if len(words) > 3 or not all(map(math.isfinite, bounds)):
            raise ValueError
    except (ValueError, UnitError) as error:
        cause = f": {error.cause}" if isinstance(error, UnitError) else ""
        raise _unusable(f"{option} '{escape(text)}' is not a range{cause}", _EXAMPLES[dimension]) from None
    if len(bounds) == 1:
        return Range(bounds[0], bounds[0], 1)
    if bounds[0] >= bounds[1] or (count is not None and count < 2):
        fault = "has fewer than 2 values" if bounds[0] < bounds[1] else "does not go up"
        raise _unusable(f"{option} '{escape(text)}' {fault}", _EXAMPLES[dimension])
    return Range(bounds[0], bounds[1], count)


def read_spacing(text: str) -> float:
    """The distance between neighbouring points [m].

    Raises:
        InvalidInput: it is not a length above 0.
    """
    try:
        spacing = _value(text, (), LENGTH)
    except (ValueError, UnitError) as error:
        cause = error.cause if isinstance(error, UnitError) else f"'{escape(text)}' is not a length"
        raise _unusable(f"--step: {cause}", "write --step '2 cm'") from None
    if not 1e-4 <= spacing <= 10.0:
        raise _unusable(f"--step '{escape(text)}' is not between 0.1 mm and 10 m", "write --step '2 cm'")
    return spacing


def grid_of(x: Range, y: Range, yaw: Range | None, spacing: float | None) -> Grid:
    """The grid of these ranges; of a range without a count all multiples of the spacing.

    `spacing` None: the least of 1, 2, 2.5, 5, 10, ... mm that gives at most `USUAL` points.

    Raises:
        InvalidInput: there are more than `MOST` points, or none.
    """
    turns = () if yaw is None else _values(yaw, math.radians(15.0))
    usual = max(1, USUAL // max(1, len(turns)))
    if spacing is None:
        fine = (step * 10.0**power for power in range(-3, 2) for step in _STEPS)
        spacing = next(step for step in fine if _size(x, step) * _size(y, step) <= usual or step > 10.0)
    size = _size(x, spacing) * _size(y, spacing) * max(1, len(turns))
    if not 0 < size <= MOST:
        fault = f"has {size} points; at most {MOST}" if size else f"has no point at a spacing of {spacing:g} m"
        raise _unusable(f"the map {fault}", "write --step '5 cm', or ranges with a number of values: --x 0.4:0.8:9")
    return Grid(_values(x, spacing), _values(y, spacing), turns)


def _size(along: Range, spacing: float) -> int:
    if along.count is not None:
        return along.count
    return math.floor(along.high / spacing + 1e-6) - math.ceil(along.low / spacing - 1e-6) + 1


def _values(along: Range, spacing: float) -> tuple[float, ...]:
    """Rounded to 1 um or 1 urad, so that they are short in a command."""
    if along.count is None:
        first = math.ceil(along.low / spacing - 1e-6)
        values = [k * spacing for k in range(first, first + _size(along, spacing))]
    else:
        values = np.linspace(along.low, along.high, along.count).tolist()
    return tuple(round(value, 6) + 0.0 for value in values)  # + 0.0: never -0.0


def _value(word: str, other: list[str] | tuple[()], dimension: Dimension) -> float:
    try:
        number = float(word)
    except ValueError:
        return to_si(word.strip(), dimension)
    unit = _UNIT.search(other[0]) if other else None
    return number if unit is None else to_si(f"{word.strip()} {unit[1]}", dimension)


def _unusable(message: str, hint: str) -> InvalidInput:
    return InvalidInput([Diagnostic("USE197", message, hint=hint)])
