"""Shortening of a path: fewer waypoints, seeded shortcuts, and corners that are pulled tight.

Shortcuts are those of Geraerts and Overmars, "Creating high-quality paths for motion planning" (IJRR 26(8), 2007),
section 3: a random part of the path is replaced by a straight line, in all joints or in one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.plan.path_planner import PathProblem

_PATIENCE: Final = 30  # attempts in a row that do not shorten the path, after which it counts as short
_WORTH: Final = 1e-3  # least relative gain
_PULLS: Final = 4  # rounds over the corners
_SHARES: Final = 0.9, 0.5, 0.25  # of the way of a corner to the line between its neighbours


def length_of(path: Array) -> float:
    """Length [rad or m] of a path (m, n) in joint space."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def shortened(path: Array, problem: PathProblem, rng: np.random.Generator, *, attempts: int) -> Array:
    """A shorter free path (k, n) between the same ends; at most `attempts` shortcuts are tried."""
    points = _reduced(list(path), problem)
    idle = 0
    for attempt in range(attempts):
        if len(points) < 3 or idle >= _PATIENCE:
            break
        shorter = _shortcut(points, problem, rng, single=attempt % 2 == 1)
        if shorter is None:
            idle += 1
            continue
        idle = idle if length_of(np.array(shorter)) > (1.0 - _WORTH) * length_of(np.array(points)) else 0
        points = shorter
    points = _reduced(points, problem)
    if attempts:
        for _ in range(_PULLS):
            before = length_of(np.array(points))
            points = _pulled(points, problem)
            if length_of(np.array(points)) > (1.0 - _WORTH) * before:
                break
    return np.array(_reduced(points, problem))


def _reduced(points: list[Array], problem: PathProblem) -> list[Array]:
    """Without waypoints that a free straight line makes needless: from each point to the farthest one it sees."""
    k = 0
    while k < len(points) - 2:
        for far in range(len(points) - 1, k + 1, -1):
            if problem.edge(points[k], points[far]):
                points = [*points[: k + 1], *points[far:]]
                break
        k += 1
    return points


def _shortcut(
    points: Sequence[Array], problem: PathProblem, rng: np.random.Generator, *, single: bool
) -> list[Array] | None:
    """The path with a random part replaced; None where that is blocked or gains nothing."""
    steps = [float(np.linalg.norm(b - a)) for a, b in pairwise(points)]
    ends = np.concatenate(([0.0], np.cumsum(steps)))
    u, v = np.sort(rng.uniform(0.0, ends[-1], 2)).tolist()
    joint = int(rng.integers(len(points[0])))
    i, j = (int(np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(steps) - 1)) for x in (u, v))
    if i == j:
        return None
    a = points[i] + (u - ends[i]) / max(steps[i], 1e-12) * (points[i + 1] - points[i])
    b = points[j] + (v - ends[j]) / max(steps[j], 1e-12) * (points[j + 1] - points[j])
    middle: list[Array] = []
    if single:
        for k in range(i + 1, j + 1):
            q = points[k].copy()
            q[joint] = a[joint] + (ends[k] - u) / (v - u) * (b[joint] - a[joint])
            middle.append(q)
    new = [a, *middle, b]
    old = [a, *points[i + 1 : j + 1], b]
    if length_of(np.array(new)) > (1.0 - _WORTH) * length_of(np.array(old)):
        return None
    if not all(problem.valid(q) for q in new) or not all(problem.edge(p, q) for p, q in pairwise(new)):
        return None
    return [*points[: i + 1], *new, *points[j + 1 :]]


def _pulled(points: Sequence[Array], problem: PathProblem) -> list[Array]:
    """The path with every corner moved towards the line between its neighbours, as far as it stays free."""
    points = list(points)
    for k in range(1, len(points) - 1):
        before, here, after = points[k - 1], points[k], points[k + 1]
        along = after - before
        square = float(along @ along)
        share = float(np.clip((here - before) @ along / square, 0.0, 1.0)) if square > 0.0 else 0.5
        foot = before + share * along
        for step in _SHARES:
            q = here + step * (foot - here)
            if problem.valid(q) and problem.edge(before, q) and problem.edge(q, after):
                points[k] = q
                break
    return points
