"""Thinning of measurements to a budget: the first one of each interval, which doubles when the budget is exceeded."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

T = TypeVar("T")


class _Series(Protocol):
    def __len__(self) -> int: ...

    def thin(self) -> int: ...


@dataclass(slots=True)
class Budget:
    """Shared by some series.

    Attributes:
        interval: of which each series keeps one measurement [s]; grows.
        most: largest sum of the sizes of what is kept.
    """

    interval: float
    most: int
    used: int = 0
    series: list[_Series] = field(default_factory=list)

    def spend(self, size: int) -> None:
        """Count a kept measurement; thins all series if there are too many."""
        self.used += size
        while self.used > self.most and any(len(series) > 1 for series in self.series):
            self.interval *= 2.0
            self.used = sum(series.thin() for series in self.series)


class Thinned(Generic[T]):
    """One series, in the order of its times."""

    def __init__(self, budget: Budget) -> None:
        self._budget = budget
        self._kept: dict[int, tuple[float, int, T]] = {}
        self.seen = 0
        budget.series.append(self)

    def __len__(self) -> int:
        return len(self._kept)

    def wants(self, time: float) -> bool:
        """Whether a measurement at `time` [s] would be kept; counts it."""
        self.seen += 1
        return self._number(time) not in self._kept

    def add(self, time: float, size: int, value: T) -> None:
        """Keep a wanted measurement."""
        self._kept[self._number(time)] = (time, size, value)
        self._budget.spend(size)

    def thin(self) -> int:
        """Keep the first one of each interval; returns the size of what is kept."""
        old = sorted(self._kept.values(), key=lambda entry: entry[0])
        self._kept = {}
        for entry in old:
            self._kept.setdefault(self._number(entry[0]), entry)
        return sum(size for _, size, _ in self._kept.values())

    def __iter__(self) -> Iterator[tuple[float, T]]:
        for time, _, value in sorted(self._kept.values(), key=lambda entry: entry[0]):
            yield time, value

    def _number(self, time: float) -> int:
        return math.floor(time / self._budget.interval + 1e-6)
