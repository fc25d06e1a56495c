"""Contract of path planners: a collision-free path (geometry without time) from one configuration to any of several.

A planner knows no robot: it gets bounds and predicates over configurations (n,), and a generator. Its budget counts
samples, so that a slow machine finds the same path.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from manipcli.core.geometry import Array
from manipcli.spec.planner import PlannerSpec


@dataclass(frozen=True, slots=True, eq=False)
class PathProblem:
    """Where a path begins and may end, and what is free.

    Attributes:
        start: (n) [rad or m].
        goals: (k, n); a path to any of them is a solution.
        lower, upper: (n) finite bounds of the samples.
        valid: whether a configuration (n) is free.
        edge: whether the straight line between two free configurations is free.
        project: the nearest configuration that fulfils the constraints of the path, None where there is none; None for
            a path without constraints. A planner projects each configuration that it adds.
    """

    start: Array
    goals: Array
    lower: Array
    upper: Array
    valid: Callable[[Array], bool]
    edge: Callable[[Array, Array], bool]
    project: Callable[[Array], Array | None] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PathFailure:
    """No path was found.

    Attributes:
        why: as text, without a subject.
        samples: drawn.
        near_start, near_goal: (n) the closest two configurations of which one is connected to the start and the other
            to a goal.
    """

    why: str
    samples: int
    near_start: Array
    near_goal: Array


class PathPlanner(Protocol):
    """A planner with its settings."""

    def plan(self, problem: PathProblem, rng: np.random.Generator) -> Array | PathFailure:
        """(m, n) waypoints from the start to one of the goals, straight and free between them; or why there are none.

        Raises:
            NotPlannable: its library is not installed.
        """
        ...


S = TypeVar("S", bound=PlannerSpec)


@dataclass(frozen=True, slots=True)
class PathPlannerMember(Generic[S]):
    """A member of the seam.

    Attributes:
        name: its `type` in task files.
        spec: the whole block `planner`, with its `type`.
        make: the planner with these settings.
    """

    name: str
    spec: type[S]
    make: Callable[[S], PathPlanner]
