"""Edges between configurations: free ones keep their distance everywhere, and no thin obstacle is missed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.model.build_robot import build_robot
from manipcli.model.collision import CollisionChecker, CollisionQuery
from manipcli.model.edge_check import SLACK, EdgeCheck
from manipcli.model.kinematics import Kinematics
from manipcli.scene.build_scene import build_scene
from manipcli.spec.robot import RobotSpec
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec

MARGIN = 0.004
POLE = '<collision><origin xyz="0.5 0 0"/><geometry><box size="0.6 0.002 0.002"/></geometry></collision>'
ARM = f"""<robot name="arm">
  <link name="base"/>
  <link name="pole">{POLE}</link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="pole"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>
"""


def checker(folder: Path, description: str, boxes: dict[str, tuple[list[float], list[float]]]) -> CollisionChecker:
    if description.startswith("<"):
        (folder / "robot.urdf").write_text(description)
        description = "robot.urdf"
    robot, _ = build_robot(RobotSpec(robot="robot", description=description), file=folder / "robot.yaml")
    bodies = {
        name: BodySpec.model_validate({"box": {"size": size}, "pose": {"xyz": xyz}, "fixed": True})
        for name, (size, xyz) in boxes.items()
    }
    fields: dict[str, Any] = {"scene": bodies, "floor": False}
    return CollisionChecker(Kinematics(robot), build_scene(TaskSpec.model_construct(**fields)))


@pytest.mark.parametrize("k", [3, 17, 40, 58])
def test_a_thin_obstacle_is_found_that_a_fixed_step_misses(tmp_path: Path, k: int) -> None:
    """A wire of 0.2 mm across the path of a pole, which passes it between two steps of 28 mrad, 20 mm at the wire."""
    a, b, steps = np.array([-0.2]), np.array([1.5]), 60
    angle = float(a[0]) + (k + 0.5) / steps * float(b[0] - a[0])
    wire = ([2e-4, 2e-4, 0.1], [0.7 * np.cos(angle), 0.7 * np.sin(angle), 0.0])
    query = checker(tmp_path, ARM, {"wire": wire}).at(margin=MARGIN)
    assert not any(query.touches(a + s * (b - a)) for s in np.linspace(0.0, 1.0, steps + 1))
    check = EdgeCheck(query)
    assert not check.free(a, b)
    assert check.blocked is not None
    assert query.touches(check.blocked)
    assert check.free(a, np.array([angle - 0.01]))  # up to it
    assert check.free(np.array([angle + 0.01]), b)  # and behind it


def test_a_free_edge_keeps_its_distance_everywhere(tmp_path: Path) -> None:
    """Of random edges of a Panda between boards: brute force by a step of 2 mrad, with coal's distances."""
    boards = {f"board_{k}": ([0.4, 0.8, 0.02], [0.6, 0.0, 0.15 + 0.22 * k]) for k in range(4)}
    made = checker(tmp_path, "package://pybullet_data/franka_panda/panda.urdf", boards)
    query, nearer = made.at(margin=MARGIN), made.at(margin=(1.0 - SLACK) * MARGIN)
    check = EdgeCheck(query)
    joints = made._kinematics.robot.moving_joints
    lower, upper = np.array([j.limits.lower for j in joints]), np.array([j.limits.upper for j in joints])
    rng = np.random.default_rng(4)
    found = {True: 0, False: 0}
    while min(found.values()) < 8:
        a = rng.uniform(lower, upper)
        b = np.clip(a + rng.normal(0.0, 0.35, len(a)), lower, upper)
        if query.touches(a) or query.touches(b):
            continue
        free = check.free(a, b)
        found[free] += 1
        if free:
            assert not any(nearer.touches(q) for q in fine(a, b))
        else:
            assert check.blocked is not None
            assert query.touches(check.blocked)
            along = (check.blocked - a) @ (b - a) / ((b - a) @ (b - a))
            assert np.allclose(check.blocked, a + along * (b - a), atol=1e-9)


def test_a_polyline_is_as_free_as_its_segments(tmp_path: Path) -> None:
    made = checker(tmp_path, ARM, {"post": ([0.05, 0.05, 0.1], [0.0, 0.6, 0.0])})
    check = EdgeCheck(made.at(margin=MARGIN))
    there = np.array([[0.0], [0.4], [0.9], [0.2]])
    assert check.free_polyline(there) is None
    where = check.free_polyline(np.array([[0.0], [0.4], [2.5], [2.9]]))
    assert where in (1, 2)
    assert check.blocked is not None
    assert 1.4 < check.blocked[0] < 1.75


def test_a_dense_polyline_needs_few_checks_where_there_is_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = checker(tmp_path, ARM, {"post": ([0.05, 0.05, 0.1], [0.0, -5.0, 0.0])})
    query = made.at(margin=MARGIN)
    check = EdgeCheck(query)
    count = []
    touches = check._inflated.touches

    def counted(q: Array, level: int) -> bool:
        count.append(level)
        return touches(q, level)

    monkeypatch.setattr(check._inflated, "touches", counted)
    assert check.free_polyline(np.linspace(0.0, 2.0, 5000)[:, None]) is None
    assert len(count) < 20


def test_a_robot_without_shapes_is_always_free(tmp_path: Path) -> None:
    text = ARM.replace(POLE, "")
    query: CollisionQuery = checker(tmp_path, text, {"post": ([0.05, 0.05, 0.1], [0.0, 0.6, 0.0])}).at(margin=MARGIN)
    assert EdgeCheck(query).free(np.array([0.0]), np.array([2.0]))


def fine(a: Array, b: Array) -> Array:
    """Configurations 2 mrad apart."""
    count = int(np.ceil(float(np.max(np.abs(b - a))) / 2e-3))
    return np.asarray(a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a))
