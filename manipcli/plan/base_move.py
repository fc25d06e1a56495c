"""How far the base of a robot would have to move along the ground to reach a pose: searched with inverse kinematics.

Moving the base by d is the same as moving the goal by -d. Rings of offsets are tried outwards, and the distance in the
direction that is found first is then halved between its ring and the one inside.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, Protocol

import numpy as np

from manipcli.core.geometry import Array, Transform

RINGS: Final = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6)
"""[m] Distances from the base that are tried."""
DIRECTIONS: Final = 8
SEEDS: Final = 4
"""Attempts per offset: from the robot's configuration, and random ones, the same for every offset."""
HALVINGS: Final = 4


class _Attempt(Protocol):
    @property
    def converged(self) -> bool: ...


class Solver(Protocol):
    """What the search needs of `InverseKinematics`."""

    @property
    def base(self) -> Transform: ...
    def random_configurations(self, seed: Array, rng: np.random.Generator, count: int) -> Iterator[Array]: ...
    def track(self, X_WT: Transform, seed: Array) -> _Attempt: ...


def base_move(solver: Solver, X_WT: Transform, seed: Array) -> Array | None:
    """The least found offset (2,) [m] of the base in x and y of the world with which the arm reaches `X_WT`.

    At most `len(RINGS) * DIRECTIONS * SEEDS` attempts, and `HALVINGS * SEEDS` more. Obstacles are not considered.

    Returns:
        None if no examined offset is enough.
    """
    starts = [seed, *solver.random_configurations(seed, np.random.default_rng(0), SEEDS - 1)]

    def reached(offset: Array) -> bool:
        goal = Transform.of(xyz=(-offset[0], -offset[1], 0.0)) @ X_WT
        return any(solver.track(goal, start).converged for start in starts)

    towards = X_WT.p[:2] - solver.base.p[:2]
    heading = math.atan2(towards[1], towards[0])
    turns = sorted(range(DIRECTIONS), key=lambda k: min(k, DIRECTIONS - k))  # towards the goal first
    inside = 0.0
    for ring in RINGS:
        for k in turns:
            angle = heading + math.tau * k / DIRECTIONS
            along = np.array([math.cos(angle), math.sin(angle)])
            if not reached(ring * along):
                continue
            low, high = inside, ring
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if reached(middle * along) else (middle, high)
            return np.asarray(high * along)
        inside = ring
    return None


def base_advice(solver: Solver, X_WT: Transform, seed: Array) -> str:
    """The found offset as a hint."""
    offset = base_move(solver, X_WT, seed)
    if offset is None:
        return f"no position of the base within {RINGS[-1]:g} m along the ground reaches it"
    x, y = (float(value) for value in solver.base.p[:2] + offset)
    return (
        f"with the base moved by {float(np.hypot(*offset)):.2f} m, to x = {x:.2f} m, y = {y:.2f} m "
        "(`mount` in the robot file), the arm reaches it, obstacles aside"
    )
