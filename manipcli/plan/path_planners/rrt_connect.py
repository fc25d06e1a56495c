"""RRT-Connect (Kuffner and LaValle, ICRA 2000): two trees of free configurations that grow towards each other.

One tree begins at the start, the other has every goal as a root. In turn, one tree grows a step towards a random
sample; the other then grows towards the new node, step by step, until it meets it or is blocked.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array
from manipcli.core.work import WorkSpent
from manipcli.plan.path_planner import PathFailure, PathPlannerMember, PathProblem
from manipcli.spec.planner import PlannerSpec

_MET = 1e-9
_SHARE = 0.1  # of the diagonal of the bounds: the longest step by default
_FIRST = 64  # nodes; the memory of a tree doubles when it is full


class RrtConnectSpec(PlannerSpec):
    """RRT-Connect: two trees that grow towards each other."""

    type: Literal["rrt_connect"] = Field("rrt_connect", description="Default rrt_connect.")
    range: Annotated[float, Field(gt=0, le=1000)] | None = Field(
        None, description="Longest step of a tree [rad or m]. Default: a tenth of the diagonal of the joints' ranges."
    )


class RrtConnect:
    """The planner, with its settings."""

    def __init__(self, spec: RrtConnectSpec) -> None:
        self._spec = spec

    def plan(self, problem: PathProblem, rng: np.random.Generator) -> Array | PathFailure:
        """See `PathPlanner.plan`. Uses at most `samples` draws of `rng`, each of n numbers."""
        step = self._spec.range or _SHARE * float(np.linalg.norm(problem.upper - problem.lower))
        start, goal = _Tree(problem.start[None], problem, step), _Tree(problem.goals, problem, step)
        nearest = goal.nearest(problem.start)
        grown, other = start, goal
        drawn, ended = 0, ""
        try:
            if goal.connect(nearest, problem.start):  # the straight path, or its free part
                return _joined(start, 0, goal, goal.size - 1)
            while drawn < self._spec.samples:
                drawn += 1
                new = grown.extend(rng.uniform(problem.lower, problem.upper))
                if new is not None:
                    near = other.nearest(grown.nodes[new])
                    if other.connect(near, grown.nodes[new]):
                        ends = (new, other.size - 1) if grown is start else (other.size - 1, new)
                        return _joined(start, ends[0], goal, ends[1])
                if grown.size > other.size or new is None:
                    grown, other = other, grown
        except WorkSpent:
            ended = ", where the work budget ended"
        i, j = _closest(start, goal)
        why = f"the two searches did not meet within {drawn} samples{ended}"
        return PathFailure(why, drawn, start.nodes[i].copy(), goal.nodes[j].copy())


class _Tree:
    """Free configurations, each with its parent (-1 for a root)."""

    def __init__(self, roots: Array, problem: PathProblem, step: float) -> None:
        self._problem, self._step = problem, step
        self._store = np.empty((max(_FIRST, 2 * len(roots)), roots.shape[1]))
        self._parents: list[int] = [-1] * len(roots)
        self._store[: len(roots)] = roots

    @property
    def size(self) -> int:
        return len(self._parents)

    @property
    def nodes(self) -> Array:
        """(size, n)."""
        return self._store[: self.size]

    def nearest(self, q: Array) -> int:
        """Index of the node nearest to `q` (n)."""
        away = self.nodes - q
        return int(np.argmin(np.einsum("ij,ij->i", away, away)))

    def extend(self, q: Array) -> int | None:
        """Grows at most one step from the nearest node towards `q`; the index of the new node, None where blocked."""
        return self._step_from(self.nearest(q), q)

    def connect(self, near: int, q: Array) -> bool:
        """Grows from a node towards `q` until it is reached or the way is blocked; whether the last node is at `q`."""
        while True:
            before = float(np.linalg.norm(q - self.nodes[near]))
            if before <= _MET:
                # The last node must be the one at `q`.
                if near != self.size - 1:
                    self._add(self.nodes[near], near)
                return True
            new = self._step_from(near, q)
            if new is None:
                return False
            if float(np.linalg.norm(q - self.nodes[new])) >= before:  # a projection led back
                return False
            near = new

    def path(self, k: int) -> list[Array]:
        """From node `k` to its root."""
        found = []
        while k >= 0:
            found.append(self.nodes[k])
            k = self._parents[k]
        return found

    def _step_from(self, near: int, q: Array) -> int | None:
        problem, origin = self._problem, self.nodes[near]
        away = q - origin
        length = float(np.linalg.norm(away))
        target = q if length <= self._step else origin + self._step / length * away
        if problem.project is not None:
            projected = problem.project(target)
            if projected is None:
                return None
            target = projected
        if not (problem.valid(target) and problem.edge(origin, target)):
            return None
        return self._add(target, near)

    def _add(self, q: Array, parent: int) -> int:
        if self.size == len(self._store):
            self._store = np.concatenate((self._store, np.empty_like(self._store)))
        self._parents.append(parent)
        self._store[self.size - 1] = q
        return self.size - 1


def _joined(start: _Tree, i: int, goal: _Tree, j: int) -> Array:
    """The path through node `i` of the one tree and `j` of the other, which are at the same place."""
    points = [*reversed(start.path(i)), *goal.path(j)]
    return np.array([q for k, q in enumerate(points) if k == 0 or float(np.max(np.abs(q - points[k - 1]))) > _MET])


def _closest(a: _Tree, b: _Tree) -> tuple[int, int]:
    """The two nearest nodes of two trees."""
    pairs = [(k, b.nearest(q)) for k, q in enumerate(a.nodes)]
    return min(pairs, key=lambda pair: float(np.linalg.norm(a.nodes[pair[0]] - b.nodes[pair[1]])))


MEMBER = PathPlannerMember(name="rrt_connect", spec=RrtConnectSpec, make=RrtConnect)
