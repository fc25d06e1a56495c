"""The varied numbers of a task as coordinates, in units of their declared spread.

The spread of `normal` is its standard deviation, of `uniform` half its width, of `choice` and `grid` half their range.
The task as written is the origin; the distance of a change is its Euclidean norm. A coordinate counts amounts as the
task writes them: an offset, a factor, or the value itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from manipcli.judge.drawn import Number
from manipcli.spec.resolved import inline
from manipcli.spec.source.tree import Plain
from manipcli.sweep.sampling import Sampling
from manipcli.task.vary import Varied

FINEST: Final = 1e-4
"""Amounts are rounded to the next decimal below this share of their spread, so that they can be read and typed."""
TAIL: Final = 2.0
"""Standard deviations that count as the declared spread of `normal`."""


@dataclass(frozen=True, slots=True)
class Coordinate:
    """A number that is changed.

    Attributes:
        name: `scene.cup.at.0` for the first component of a list.
        quantity: the varied quantity.
        k: component of the quantity.
        nominal: amount in the task as written.
        spread: of the amount, above 0.
        least, most: declared bounds, in spreads from the task as written.
    """

    name: str
    quantity: Varied
    k: int
    nominal: float
    spread: float
    least: float
    most: float

    def amount(self, x: float) -> float:
        """The amount at x spreads from the task as written, rounded; whole for a whole number."""
        if x == 0.0:
            return self.nominal
        amount = self.nominal + x * self.spread
        if self.quantity.whole and self.quantity.how != "scale":
            return round(amount)
        return round(amount, -math.floor(math.log10(FINEST * self.spread)))

    def spreads(self, amount: float) -> float:
        """The inverse of `amount`, up to its rounding."""
        return (amount - self.nominal) / self.spread


@dataclass(frozen=True, slots=True)
class Point:
    """A change: the amount of each coordinate, and how far it is from the task as written, in spreads."""

    amounts: tuple[float, ...]
    x: tuple[float, ...]

    @property
    def distance(self) -> float:
        """Euclidean norm of `x`."""
        return math.hypot(*self.x)

    @property
    def changed(self) -> tuple[int, ...]:
        """Indices of the coordinates that are not as written."""
        return tuple(k for k, x in enumerate(self.x) if x != 0.0)


class Space:
    """The coordinates of a task."""

    def __init__(self, sampling: Sampling) -> None:
        """
        Args:
            sampling: the samples of the task.
        """
        drawn = {path for path, _ in sampling.written.drawn(0).values}  # an override sets the others
        found = (
            _coordinate(quantity, k)
            for quantity in sampling.written.varied
            if quantity.path in drawn
            for k in range(len(quantity.nominal))
        )
        self.coordinates = tuple(coordinate for coordinate in found if coordinate is not None)
        self._sampling = sampling

    @property
    def origin(self) -> Point:
        """The task as written."""
        return self.point([0.0] * len(self.coordinates))

    def point(self, x: Sequence[float]) -> Point:
        """The point nearest to `x` [spreads] with rounded amounts."""
        amounts = tuple(each.amount(u) for each, u in zip(self.coordinates, x, strict=True))
        return Point(amounts, tuple(each.spreads(a) for each, a in zip(self.coordinates, amounts, strict=True)))

    def sample(self, number: int) -> Point:
        """The point of a sample of the task."""
        drawn = dict(self._sampling.written.drawn(number).values)
        return self.point([each.spreads(_amount(each, drawn[each.quantity.path])) for each in self.coordinates])

    def inside(self, point: Point) -> bool:
        """Whether a point is within the declared spread."""
        return all(
            each.least - FINEST <= x <= each.most + FINEST for each, x in zip(self.coordinates, point.x, strict=True)
        )

    def reach(self, direction: Sequence[float]) -> float:
        """The distance at which a ray from the task as written leaves the declared spread; at least 1."""
        ends = [
            (each.most if u > 0.0 else each.least) / u
            for each, u in zip(self.coordinates, direction, strict=True)
            if u != 0.0
        ]
        return max(min((end for end in ends if end > 0.0), default=1.0), 1.0)

    def value(self, k: int, point: Point) -> float:
        """The value of coordinate k in the simulated world at a point [SI]."""
        each = self.coordinates[k]
        value = self._written(each.quantity, point)
        return float(value[each.k] if isinstance(value, tuple) else value)

    def vary(self, point: Point) -> dict[str, Plain]:
        """The block `vary:` whose only sample is this point."""
        named = {self.coordinates[k].quantity.path: self.coordinates[k].quantity for k in point.changed}
        if not named:  # a block with no number has no samples
            named = {self.coordinates[0].quantity.path: self.coordinates[0].quantity}
        block: dict[str, Plain] = {}
        for path, quantity in named.items():
            amounts: list[Plain] = [*self._amounts(quantity, point)]
            law: dict[str, Plain] = {"choice": [amounts if quantity.vector else amounts[0]]}
            block[path] = {quantity.how: law} if quantity.how else law
        return block

    def override(self, point: Point) -> str:
        """`vary` of a point as an override, for `--set`."""
        return f"vary={inline(self.vary(point))}"

    def _amounts(self, quantity: Varied, point: Point) -> list[float]:
        own = {
            each.k: amount
            for each, amount in zip(self.coordinates, point.amounts, strict=True)
            if each.quantity is quantity
        }
        return [own.get(k, _nominal(quantity, k)) for k in range(len(quantity.nominal))]

    def _written(self, quantity: Varied, point: Point) -> Number:
        values = [
            {"offset": amount + nominal, "scale": amount * nominal}.get(quantity.how, amount)
            for amount, nominal in zip(self._amounts(quantity, point), quantity.nominal, strict=True)
        ]
        return tuple(values) if quantity.vector else values[0]


def _coordinate(quantity: Varied, k: int) -> Coordinate | None:
    """Component k as a coordinate; None if it has one value, which is that of the task as written."""
    rows, nominal = quantity.law.rows, _nominal(quantity, k)
    if quantity.how == "scale" and quantity.nominal[k] == 0.0:
        return None
    if quantity.law.word == "normal":
        mean, spread = rows[0][k], rows[1][k]
        least, most = mean - TAIL * spread, mean + TAIL * spread
    else:
        least, most = min(row[k] for row in rows), max(row[k] for row in rows)
        spread = 0.5 * (most - least) or abs(most - nominal)
    if spread <= 0.0:
        return None
    name = f"{quantity.path}.{k}" if quantity.vector else quantity.path
    return Coordinate(
        name, quantity, k, nominal, spread, min((least - nominal) / spread, 0.0), max((most - nominal) / spread, 0.0)
    )


def _nominal(quantity: Varied, k: int) -> float:
    """The amount of component k in the task as written."""
    return {"offset": 0.0, "scale": 1.0}.get(quantity.how, quantity.nominal[k])


def _amount(coordinate: Coordinate, value: Number) -> float:
    """The amount that gives a drawn value."""
    quantity, k = coordinate.quantity, coordinate.k
    own = value[k] if isinstance(value, tuple) else value
    if quantity.how == "offset":
        return own - quantity.nominal[k]
    return own / quantity.nominal[k] if quantity.how == "scale" else own
