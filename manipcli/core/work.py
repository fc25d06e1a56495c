"""Planning work, counted in units, and its budgets.

What takes the time of a plan is counted where it is done: collision checks, iterations of the inverse kinematics,
checked edges, timings of paths. A unit is about 0.035 ms on a quiet machine; no clock is read, so that a slow machine
makes the same plan and the same refusal.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

TOUCH: Final = 1
"""Units of a collision check that ends at the first contact."""
PAIRS: Final = 32
"""Pairs of shapes for one unit of a collision check that finds all contacts and their depths."""
ITERATION: Final = 1
"""Units of an iteration of the inverse kinematics."""
EDGE: Final = 15
"""Units of an edge or a polyline in joint space, beside its collision checks."""
TIMING: Final = 400
"""Units of the timing of a path."""
MARGINS: Final = 30
"""Units of the margins of constraints along a piece of a path."""


class WorkSpent(Exception):
    """The budget of a search is spent. It passes through everything that tries the next where one thing fails."""


class Work:
    """The work of one planner.

    Attributes:
        spent: units since the start.
        doing: receives what takes long before it begins, for progress.
    """

    def __init__(self) -> None:
        self.spent = 0
        self.doing: Callable[[str], None] = lambda _: None
        self._most: float = float("inf")

    def add(self, units: int) -> None:
        """Counts work that is about to be done.

        Raises:
            WorkSpent: the units are beyond the budget of a `within` around this call.
        """
        self.spent += units
        if self.spent > self._most:
            raise WorkSpent

    @contextmanager
    def beyond(self, units: int) -> Iterator[None]:
        """Allows this much more inside, to find out why a search found nothing within its budget."""
        before = self._most
        self._most = max(before, self.spent + units)
        try:
            yield
        finally:
            self._most = before

    @contextmanager
    def within(self, units: float) -> Iterator[None]:
        """A budget for the work inside; that of a `within` around this one remains."""
        before = self._most
        self._most = min(before, self.spent + units)
        try:
            yield
        finally:
            self._most = before
