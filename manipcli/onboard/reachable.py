"""Where a hand can pick and place: on the floor or on a desk that the arm reaches with the tool the right way."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.kinematics import Kinematics
from manipcli.onboard.home import HomeSearch
from manipcli.plan.inverse_kinematics import InverseKinematics

ABOVE: Final = 0.12
"""[m] The tool must also reach so high above the place: to come and to lift."""
STEP: Final = 0.1
"""[m] between the examined heights and distances; more for a robot so large that there would be over `CELLS`."""
CELLS: Final = 100
"""Heights and distances at most: a description in the wrong unit can be kilometres large."""
ASIDE: Final = (25.0, 40.0)
"""[deg] Place and pick are so far to the left and the right of the direction in which the arm starts."""
LEAST_APART: Final = 0.12
"""[m] from the place where the block is picked to where it is placed."""
STARTS: Final = 6
"""Random starts of the inverse kinematics, after the home position."""
FLOOR_BONUS: Final = 2.0
"""The floor counts so much more than a desk, which could be in the way."""
EXAMINED: Final = 60
"""Places examined at most for each approach, spread over heights and distances."""

BATCH: Final = 15
"""Places that are examined before the best of them are tried."""

Approach = Literal["top", "side"]
APPROACHES: Final[tuple[Approach, ...]] = ("top", "side")


@dataclass(frozen=True, slots=True)
class Spots:
    """Where a block is picked and placed.

    Attributes:
        height: [m] of the support; 0: the floor.
        pick, place: (x, y) [m].
        approach: how the hand comes.
        score: smallest singular value of the tool's Jacobian at these places; on the floor times `FLOOR_BONUS`.
    """

    height: float
    pick: tuple[float, float]
    place: tuple[float, float]
    approach: Approach
    score: float


def reachable_spots(
    kinematics: Kinematics,
    search: HomeSearch,
    joints: tuple[str, ...],
    home: Array,
    *,
    tool_height: float,
    above: float = ABOVE,
    seed: int = 0,
) -> Iterator[Spots]:
    """Candidates, the more dexterous of each batch first; those from the top before those from the side.

    Args:
        kinematics: of the robot, with its tool.
        search: checks configurations for collisions.
        joints: of the arm.
        home: (n) the start.
        tool_height: [m] of the tool above the support.
        above: [m] so much higher the tool must also reach.
        seed: of the inverse kinematics.
    """
    tool = kinematics.robot.tool
    assert tool is not None
    solver = InverseKinematics(kinematics, joints, tool.link, X_LT=tool.X_LT)
    reach = _Reach(solver, search, home, np.random.default_rng(seed), above)
    first = kinematics.robot.joint(joints[0]).child
    axis = kinematics.forward(home, first).p
    ahead = solver.forward(home).p - axis
    front = float(np.arctan2(ahead[1], ahead[0]))
    far = _farthest(solver, search, home, axis)
    step = max(STEP, (axis[2] + far) / CELLS)
    heights = [0.0, *np.arange(step, axis[2] + 0.7 * far, step).tolist()]
    radii = np.arange(max(0.15, 0.2 * far), far, STEP / 2 if far < 0.6 else step).tolist()
    grid = sorted(itertools.product(heights, radii), key=lambda cell: _oddness(cell, axis, far))
    grid = [(h, r) for h, r in grid if np.hypot(r, h + tool_height - axis[2]) < far][:EXAMINED]
    for approach in APPROACHES:
        open_ = solver.leaving("spin" if approach == "top" else "nothing")
        for start in range(0, len(grid), BATCH):
            own = [
                spots
                for h, r in grid[start : start + BATCH]
                if (spots := reach.spots(open_, h, r, front, axis, tool_height, approach)) is not None
            ]
            yield from sorted(own, key=lambda spots: -spots.score)


class _Reach:
    def __init__(
        self, solver: InverseKinematics, search: HomeSearch, home: Array, rng: np.random.Generator, above: float
    ) -> None:
        self._solver, self._search, self._home, self._above = solver, search, home, above
        self._starts = [home, *solver.random_configurations(home, rng, STARTS)]

    def spots(
        self, solver: InverseKinematics, h: float, r: float, front: float, axis: Array, up: float, approach: Approach
    ) -> Spots | None:
        """The places at a height and a distance, if the arm reaches both."""
        for degrees in ASIDE:
            aside = float(np.radians(degrees))
            if 2.0 * r * np.sin(aside) < LEAST_APART:
                continue
            places = [
                (float(axis[0] + r * np.cos(a)), float(axis[1] + r * np.sin(a))) for a in (front - aside, front + aside)
            ]
            scores = []
            for (x, y), a in zip(places, (front - aside, front + aside), strict=True):
                for z in (h + up, h + up + self._above):
                    score = self._reached(solver, Transform.of(xyz=(x, y, z), R=_tool_axes(approach, a)))
                    if score is None:
                        break
                    scores.append(score)
            if len(scores) == 4:
                (px, py), (gx, gy) = ((round(x, 3), round(y, 3)) for x, y in places)
                bonus = FLOOR_BONUS if h == 0.0 else 1.0
                return Spots(round(h, 3), (px, py), (gx, gy), approach, bonus * min(scores))
        return None

    def _reached(self, solver: InverseKinematics, X_WT: Transform) -> float | None:
        """The smallest singular value where the tool is at this pose, without collisions; None if it cannot be."""
        for start in self._starts:
            solution = solver.track(X_WT, start)
            if solution.converged and not self._search.query.touches(solution.q):
                return max(1e-3, self._solver.least_singular_value(solution.q))
        return None


def _oddness(cell: tuple[float, float], axis: Array, far: float) -> float:
    """How unusual a place is: the middle of the reach, a little below the arm's first joint or on the floor."""
    h, r = cell
    low = min(abs(h - max(0.0, float(axis[2]) - 0.3 * far)), h)
    return abs(r - 0.55 * far) + low


def _farthest(solver: InverseKinematics, search: HomeSearch, home: Array, axis: Array) -> float:
    """[m] from the first joint to the tool, over random configurations."""
    rng = np.random.default_rng(1)
    return max(
        float(np.linalg.norm(solver.forward(search.whole(arm)).p - axis))
        for arm in rng.uniform(search.lower, search.upper, (300, len(search.lower)))
    )


def _tool_axes(approach: Approach, yaw: float) -> Array:
    """R_WT (3, 3): z down or away from the base; y level."""
    ahead, left = np.array([np.cos(yaw), np.sin(yaw), 0.0]), np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    z = np.array([0.0, 0.0, -1.0]) if approach == "top" else ahead
    y = left if approach == "side" else -left
    return np.column_stack([np.cross(y, z), y, z])
