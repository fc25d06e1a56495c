"""Where a hand can pick and place: cells of the space in which many configurations hold the tool the right way."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from manipcli.core.geometry import Array, rotate
from manipcli.model.batch_kinematics import tool_poses
from manipcli.model.configuration import with_mimics
from manipcli.model.robot import RobotModel

SAMPLES: Final = 40_000
CELL: Final = 0.05
"""[m] Size of a cell in radius and height."""
SECTOR: Final = np.radians(20.0)
WITHIN: Final = np.cos(np.radians(25.0))
"""Least cosine between the tool's axis and the direction of the approach."""
LIFT: Final = 2
"""Cells above the place that the tool must reach, too."""
MOST_HEIGHTS: Final = 3
"""Heights of the support that are tried."""
PAIRS: Final = 4
"""Pairs of places that are tried at each height."""
LEAST_APART: Final = 0.12
"""[m] from the place where the block is picked to where it is placed."""
FLOOR_SHARE: Final = 0.4
"""The floor is preferred if it has at least this share of the best height's configurations."""

Approach = Literal["top", "side"]


@dataclass(frozen=True, slots=True)
class Spots:
    """Where a block is picked and placed.

    Attributes:
        height: [m] of the support; 0: the floor.
        pick, place: (x, y) [m].
        approach: how the hand comes.
        count: configurations, of `SAMPLES`, that hold the tool so there.
    """

    height: float
    pick: tuple[float, float]
    place: tuple[float, float]
    approach: Approach
    count: int


def reachable_spots(robot: RobotModel, joints: tuple[str, ...], q: Array, *, tool_height: float, seed: int = 0) -> Iterator[Spots]:
    """Candidates, the most reachable first.

    Args:
        robot: with its tool.
        joints: of the arm.
        q: (n) all joints; those of the arm are drawn.
        tool_height: [m] of the tool above the support.
        seed: of the drawn configurations.
    """
    rng = np.random.default_rng(seed)
    columns = robot.indices(joints)
    ranges = np.array([robot.joint(name).limits.within_soft for name in joints])
    lower = np.where(np.isfinite(ranges[:, 0]), ranges[:, 0], -np.pi)
    upper = np.where(np.isfinite(ranges[:, 1]), ranges[:, 1], np.pi)
    centre, half = (lower + upper) / 2.0, 0.95 * (upper - lower) / 2.0
    drawn = np.tile(q, (SAMPLES, 1))
    drawn[:, columns] = rng.uniform(centre - half, centre + half, (SAMPLES, len(columns)))
    p, quat = tool_poses(robot, with_mimics(robot, drawn))
    z, y = rotate(quat, np.array([0.0, 0.0, 1.0])), rotate(quat, np.array([0.0, 1.0, 0.0]))
    down = -z[:, 2] > WITHIN
    side = (np.abs(z[:, 2]) < np.sqrt(1.0 - WITHIN**2)) & (np.abs(y[:, 2]) < np.sqrt(1.0 - WITHIN**2))
    axis = robot.X_WB.p[:2]
    found = [*_spots(p[down], axis, tool_height, "top"), *_spots(p[side], axis, tool_height, "side")]
    return iter(sorted(found, key=lambda spots: (spots.approach == "side" and down.sum() > SAMPLES // 500)))


def _spots(p: Array, axis: Array, tool_height: float, approach: Approach) -> Iterator[Spots]:
    if len(p) < 10:
        return
    flat = p[:, :2] - axis
    radius, angle = np.linalg.norm(flat, axis=1), np.arctan2(flat[:, 1], flat[:, 0])
    level = np.round((p[:, 2] - tool_height) / CELL).astype(int)
    ring, sector = np.round(radius / CELL).astype(int), np.round(angle / SECTOR).astype(int)
    cells: dict[int, dict[tuple[int, int], int]] = {}
    for h, r, s in zip(level.tolist(), ring.tolist(), sector.tolist(), strict=True):
        here = cells.setdefault(h, {})
        here[r, s] = here.get((r, s), 0) + 1
    scored: dict[int, dict[tuple[int, int], int]] = {}
    for h, here in cells.items():
        if h >= 0:
            above = cells.get(h + LIFT, {})
            scored[h] = {cell: min(count, above.get(cell, 0)) for cell, count in here.items() if cell[0] > 1}
    totals = {h: sum(sorted(here.values())[-12:]) for h, here in scored.items()}
    heights = sorted((h for h in totals if totals[h] > 0), key=lambda h: -totals[h])
    if not heights:
        return
    if 0 in totals and totals[0] >= FLOOR_SHARE * totals[heights[0]]:
        heights = [0, *(h for h in heights if h)]
    chosen: list[int] = []
    for h in heights:
        if all(abs(h - other) > 1 for other in chosen):
            chosen.append(h)
    for h in chosen[:MOST_HEIGHTS]:
        for pick, place, count in itertools.islice(_pairs(scored[h]), PAIRS):
            yield Spots(h * CELL, _xy(pick, axis), _xy(place, axis), approach, count)


def _pairs(cells: dict[tuple[int, int], int]) -> Iterator[tuple[tuple[int, int], tuple[int, int], int]]:
    """Two cells at about the same radius, two or three sectors apart; those ahead of the robot first where equal."""
    smooth = {
        (r, s): min(cells.get((r, s), 0), cells.get((r + 1, s), 0), cells.get((r - 1, s), 0)) or cells[r, s] // 4
        for r, s in cells
    }
    pairs = []
    for (r, s), count in smooth.items():
        for step in (2, 3, 4):
            other = (r, s + step)
            if other in smooth and 2.0 * r * CELL * np.sin(step * SECTOR / 2.0) >= LEAST_APART:
                both = min(count, smooth[other])
                ahead = abs(s + step / 2.0)
                pairs.append((both / (1.0 + 0.1 * ahead), (r, s), other, min(cells[r, s], cells[other])))
                break
    pairs.sort(key=lambda pair: (-pair[0], pair[1]))
    used: set[tuple[int, int]] = set()
    for score, first, second, count in pairs:
        if score <= 0.0 or any(abs(first[0] - r) <= 1 and abs(first[1] - s) <= 1 for r, s in used):
            continue
        used.add(first)
        yield first, second, count


def _xy(cell: tuple[int, int], axis: Array) -> tuple[float, float]:
    r, a = cell[0] * CELL, cell[1] * SECTOR
    return round(float(axis[0] + r * np.cos(a)), 3), round(float(axis[1] + r * np.sin(a)), 3)
