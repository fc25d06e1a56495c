"""Problems for path planners, made here: a Panda before a table, shelves, in a cage and above a deep box.

Each problem is a scene of fixed boxes, a start and a goal configuration; both keep the planner's clearance. Sizes and
places vary with the seed. Start and goal are tool poses at places that make the kind hard (in a compartment, behind a
bar, in the box), solved by inverse kinematics.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel
from manipcli.plan.planner import Planner
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec
from manipcli.task.robot_file import read_robot

PANDA = Path(__file__).resolve().parents[1] / "robots" / "panda" / "robot.yaml"
HAND = "panda_finger_joint1"
COUNT = 20
DOWN = np.diag([1.0, -1.0, -1.0])

Boxes = dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]]
"""Name -> size and centre [m]."""
Draft = tuple[Boxes, list[Transform], list[Transform]]
"""Boxes, and tool poses for the start and for the goal, of which the first reachable ones are used."""


@dataclass(frozen=True, eq=False)
class Problem:
    """One problem. `start`, `goal`: (n) all joints."""

    kind: str
    number: int
    scene: Scene
    planner: Planner
    start: Array
    goal: Array


def problems(kind: str, count: int = COUNT) -> Iterator[Problem]:
    """The problems of a kind, the same in every run."""
    _, robot, _ = read_robot(PANDA)
    seed, made = 0, 0
    while made < count:
        rng = np.random.default_rng([sorted(KINDS).index(kind), seed])
        seed += 1
        problem = _problem(robot, kind, made, rng)
        if problem is not None:
            made += 1
            yield problem


def _problem(robot: RobotModel, kind: str, number: int, rng: np.random.Generator) -> Problem | None:
    boxes, starts, goals = KINDS[kind](rng)
    bodies = {
        name: BodySpec.model_validate({"box": {"size": list(size)}, "pose": {"xyz": list(xyz)}, "fixed": True})
        for name, (size, xyz) in boxes.items()
    }
    fields: dict[str, Any] = {"scene": bodies}
    scene = build_scene(TaskSpec.model_construct(**fields))
    planner = Planner(robot, scene, period=1e-3, rng=rng, gripper_joints=(HAND,), gripper_speed=0.1)
    start, goal = _configuration(planner, rng, starts), _configuration(planner, rng, goals)
    return None if start is None or goal is None else Problem(kind, number, scene, planner, start, goal)


def _configuration(planner: Planner, rng: np.random.Generator, poses: list[Transform]) -> Array | None:
    """A configuration that keeps the clearance, with the tool at one of the poses and the hand half open."""
    query = planner.checker.at(margin=0.005)
    seed = np.array([0.0, -0.8, 0.0, -2.2, 0.0, 1.6, 0.8, 0.02, 0.02])
    for pose in poses:
        try:
            return planner.solver.solve(pose, seed, rng, refuse=lambda q: query.touches(q) or None)
        except NotPlannable:
            continue
    return None


def _down(x: float, y: float, z: float, yaw: float = 0.0) -> Transform:
    return Transform.of(xyz=(x, y, z), R=Transform.of(rpy=(0.0, 0.0, yaw)).R @ DOWN)


def _forward(x: float, y: float, z: float, yaw: float, roll: float = 0.0) -> Transform:
    """The tool points horizontally."""
    R = Transform.of(rpy=(0.0, 0.0, yaw)).R @ np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    return Transform.of(xyz=(x, y, z), R=R @ Transform.of(rpy=(0.0, 0.0, roll)).R)


def _table(rng: np.random.Generator) -> Draft:
    """A table with upright boxes; the tool goes from beside one box to beside another."""
    top = rng.uniform(0.15, 0.3)
    boxes: Boxes = {"table": ((0.7, 1.4, 0.04), (0.62, 0.0, top - 0.02))}
    places: list[tuple[float, float]] = []
    while len(places) < 7:
        x, y = rng.uniform(0.38, 0.75), rng.uniform(-0.55, 0.55)
        if all(math.hypot(x - a, y - b) > 0.17 for a, b in places):
            places.append((float(x), float(y)))
    for k, (x, y) in enumerate(places):
        height = rng.uniform(0.12, 0.35)
        boxes[f"box_{k}"] = ((rng.uniform(0.04, 0.09), rng.uniform(0.04, 0.09), height), (x, y, top + height / 2))

    def beside() -> list[Transform]:
        found = []
        for _ in range(40):
            x, y = rng.uniform(0.38, 0.7), rng.uniform(-0.5, 0.5)
            if min(math.hypot(x - a, y - b) for a, b in places) > 0.11:
                found.append(_down(x, y, top + rng.uniform(0.03, 0.1), rng.uniform(-1.5, 1.5)))
        return found

    left = [pose for pose in beside() if pose.p[1] > 0.12]
    return boxes, left, [pose for pose in beside() if pose.p[1] < -0.12]


def _shelf(rng: np.random.Generator, *, height: float, boards: int, width: float, columns: int, board: float) -> Draft:
    """A bookshelf with boards and walls; the tool goes from one compartment to another."""
    x = rng.uniform(0.55, 0.65)
    y = rng.uniform(-0.1, 0.1)
    foot = rng.uniform(0.0, 0.15)
    depth = rng.uniform(0.25, 0.32)
    rise = height / boards
    boxes: Boxes = {"back": ((board, width, height), (x + depth, y, foot + height / 2))}
    middle = x + depth / 2
    for k in range(boards + 1):
        boxes[f"board_{k}"] = ((depth, width + board, board), (middle, y, foot + k * rise))
    for k in range(columns + 1):
        boxes[f"wall_{k}"] = ((depth, board, height), (middle, y - width / 2 + k * width / columns, foot + height / 2))

    def inside(row: int, column: int) -> list[Transform]:
        z = foot + (row + 0.5) * rise
        side = y - width / 2 + (column + 0.5) * width / columns
        deep = [x + rng.uniform(0.02, 0.5 * depth) for _ in range(6)]
        return [
            _forward(reach, side + shift, z, yaw, roll)
            for reach in deep
            for shift in (0.0, 0.02, -0.02)
            for yaw in (0.0, 0.25, -0.25)
            for roll in (math.pi / 2, 0.0)
        ]

    cells = [(row, column) for row in range(boards) for column in range(columns) if 0.1 < foot + row * rise < 0.75]
    first, second = rng.choice(len(cells), 2, replace=False).tolist()
    return boxes, inside(*cells[first]), inside(*cells[second])


def _cage(rng: np.random.Generator) -> Draft:
    """Bars around the robot's workspace; the tool goes from the middle of the cage to beyond one of its sides."""
    half, high, bar = rng.uniform(0.42, 0.5), rng.uniform(0.7, 0.85), 0.03
    x = 0.35
    boxes: Boxes = {}
    for k, (dx, dy) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        boxes[f"post_{k}"] = ((bar, bar, high), (x + dx * half, dy * half, high / 2))
    for level, z in enumerate((0.25 * high + rng.uniform(0.0, 0.1), high)):
        for k, sign in enumerate((1, -1)):
            boxes[f"rail_x{level}{k}"] = ((2 * half, bar, bar), (x, sign * half, z))
            boxes[f"rail_y{level}{k}"] = ((bar, 2 * half, bar), (x + sign * half, 0.0, z))
    for k, y in enumerate((-half / 3, half / 3)):
        boxes[f"bar_{k}"] = ((bar, bar, high), (x + half, y + rng.uniform(-0.03, 0.03), high / 2))
    starts = [_down(rng.uniform(0.4, 0.55), rng.uniform(-0.25, 0.25), rng.uniform(0.15, 0.4)) for _ in range(20)]
    side = rng.choice([-1.0, 1.0])
    outside = [
        _forward(x + rng.uniform(-0.1, 0.15), side * (half + rng.uniform(0.06, 0.12)), z, side * math.pi / 2, roll)
        for z in rng.uniform(0.45 * high, 0.75 * high, 15).tolist()
        for roll in (0.0, math.pi / 2)
    ]
    ahead = [
        _forward(x + half + rng.uniform(0.04, 0.1), rng.uniform(-0.3, 0.3), z, 0.0, roll)
        for z in rng.uniform(0.45 * high, 0.8 * high, 15).tolist()
        for roll in (0.0, math.pi / 2)
    ]
    return boxes, starts, (outside if rng.uniform() < 0.5 else ahead)


def _box(rng: np.random.Generator) -> Draft:
    """Two deep open boxes; the tool goes from the bottom of one to the bottom of the other."""
    boxes: Boxes = {}
    ends: list[list[Transform]] = []
    for k, y in enumerate((rng.uniform(0.22, 0.32), rng.uniform(-0.32, -0.22))):
        x, size, deep, wall = rng.uniform(0.45, 0.58), rng.uniform(0.24, 0.32), rng.uniform(0.18, 0.26), 0.015
        foot = rng.uniform(0.02, 0.15)
        boxes[f"floor_{k}"] = ((size, size, wall), (x, y, foot))
        for j, (dx, dy) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1))):
            lengths = (wall, size, deep) if dx else (size, wall, deep)
            boxes[f"side_{k}{j}"] = (lengths, (x + dx * size / 2, y + dy * size / 2, foot + deep / 2))
        ends.append([_down(x, y, foot + rng.uniform(0.06, 0.1), yaw) for yaw in rng.uniform(-1.5, 1.5, 30).tolist()])
    return boxes, ends[0], ends[1]


KINDS: dict[str, Callable[[np.random.Generator], Draft]] = {
    "table": _table,
    "bookshelf tall": lambda rng: _shelf(rng, height=1.1, boards=4, width=0.8, columns=1, board=0.02),
    "bookshelf small": lambda rng: _shelf(rng, height=0.7, boards=2, width=0.7, columns=2, board=0.02),
    "bookshelf thin": lambda rng: _shelf(rng, height=1.0, boards=4, width=0.36, columns=1, board=0.01),
    "cage": _cage,
    "box": _box,
}
"""Draws the boxes, the starts and the goals of each kind."""
