"""A run of the search: its point and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from manipcli.sweep.results import SampleResult
from manipcli.sweep.shrink.space import Point

Outcome = Literal["passed", "failed", "refused", "crashed"]
"""`failed`: a simulated run does not pass. `refused`: the task with these values is invalid, or has no plan. `crashed`:
it ends without a verdict (a crash, no progress, a diverged simulation)."""


class Spent(Exception):
    """The budget of runs is spent."""


@dataclass(frozen=True, slots=True)
class Way:
    """A way of failing: the step and the expectation that break; or neither, where the task is refused."""

    step: str
    broken: str

    def __str__(self) -> str:
        """`step 'lift_1'; near`."""
        return "; ".join(part for part in (f"step '{self.step}'" if self.step else "", self.broken) if part)


@dataclass(frozen=True, slots=True)
class Trial:
    """A run at a point.

    Attributes:
        point: the change.
        outcome: what came of it.
        result: the same as of a sample.
    """

    point: Point
    outcome: Outcome
    result: SampleResult

    @property
    def way(self) -> Way:
        """How it fails."""
        return Way(self.result.step, self.result.broken)


Fails = Callable[[Trial], bool]


class Evaluate(Protocol):
    """Runs the task at points."""

    def __call__(self, points: Sequence[Point], doing: str) -> list[Trial]:
        """The trials at these points, in their order; none is run twice.

        Args:
            points: where.
            doing: what the search does, for progress.

        Raises:
            Spent: the budget does not suffice.
        """
