"""No point of a part moves further than its bound: for random edges and every vertex of the parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.model.build_robot import build_robot
from manipcli.model.configuration import position_limits
from manipcli.model.kinematics import Kinematics
from manipcli.model.motion_bound import MotionBound, Mover
from manipcli.spec.robot import RobotSpec

ROOT = Path(__file__).parents[2]
LINKS = """
<robot name="sliding">
  <link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="a"/><axis xyz="1 0 0"/>
    <limit lower="-0.5" upper="0.8" effort="1" velocity="1"/></joint>
  <joint name="turn" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0.1 0.3" rpy="0.3 0 0"/>
    <axis xyz="0 1 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="reach" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.2 0 0" rpy="0 0.5 0"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.4" effort="1" velocity="1"/></joint>
  <joint name="wrist" type="continuous"><parent link="c"/><child link="d"/><origin xyz="0 0 0.1"/>
    <axis xyz="1 0 0"/></joint>
  <joint name="other" type="revolute"><parent link="a"/><child link="e"/><origin xyz="0 -0.2 0"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
</robot>
"""


@pytest.fixture(scope="module", params=["panda", "sliding"])
def kinematics(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Kinematics:
    description = "package://pybullet_data/franka_panda/panda.urdf"
    folder = tmp_path_factory.mktemp("robot")
    if request.param == "sliding":
        (folder / "robot.urdf").write_text(LINKS)
        description = "robot.urdf"
    spec = RobotSpec(robot="robot", description=description)
    robot, _ = build_robot(spec, file=folder / "robot.yaml")
    return Kinematics(robot)


def movers(kinematics: Kinematics, rng: np.random.Generator) -> list[Mover]:
    """A random ball in every joint's frame, seen from the world and from every other joint."""
    n = kinematics.model.njoints
    chains: list[set[int]] = [set()]
    for k in range(1, n):
        chains.append({*chains[kinematics.model.parents[k]], k})
    return [
        Mover(joint, seen, rng.uniform(-0.2, 0.2, 3), float(rng.uniform(0.01, 0.15)))
        for joint in range(1, n)
        for seen in range(n)
        if not chains[joint] <= chains[seen]
    ]


def poses(kinematics: Kinematics, q: Array) -> list[Array]:
    """Homogeneous matrices (4, 4) of the world and of every joint."""
    import pinocchio as pin

    data = kinematics.model.createData()
    pin.forwardKinematics(kinematics.model, data, q)
    return [X.homogeneous.copy() for X in data.oMi]


def common(kinematics: Kinematics, a: int, b: int) -> int:
    """The last joint that moves both."""
    while a != b:
        a, b = (kinematics.model.parents[a], b) if a > b else (a, kinematics.model.parents[b])
    return a


@pytest.mark.parametrize("size", [0.02, 0.3, 2.0])
def test_no_point_moves_further_than_the_bound(kinematics: Kinematics, size: float) -> None:
    rng = np.random.default_rng(int(100 * size))
    chosen = movers(kinematics, rng)
    bound = MotionBound(kinematics, chosen)
    n = kinematics.model.nq
    tightest = []
    lower, upper = np.clip(position_limits(kinematics.robot.moving_joints), -3.0, 3.0)
    for _ in range(10):
        a = rng.uniform(lower, upper)
        b = np.clip(a + rng.uniform(-size, size, n), lower, upper)
        b = a + (b - a) * rng.integers(0, 2, n)
        segments = int(rng.integers(1, 6))
        limits = bound.along(a, b, segments)
        points = a + np.linspace(0.0, 1.0, segments + 1)[:, None] * (b - a)
        assert np.allclose(limits, bound.lengths(points), atol=1e-12)
        for k in range(segments):
            fine = points[k] + np.linspace(0.0, 1.0, 21)[:, None] * (points[k + 1] - points[k])
            frames = [poses(kinematics, q) for q in fine]
            for row, mover in enumerate(chosen):
                away = rng.normal(size=3)
                point = np.append(mover.centre + mover.radius * away / np.linalg.norm(away), 1.0)
                last = common(kinematics, mover.joint, mover.seen_from)
                seen = np.array([(np.linalg.inv(X[last]) @ X[mover.joint] @ point)[:3] for X in frames])
                length = float(np.linalg.norm(np.diff(seen, axis=0), axis=1).sum())
                assert length <= limits[k, row] + 1e-12
                # On any part of a segment: at most that share.
                part = float(np.linalg.norm(np.diff(seen[3:8], axis=0), axis=1).sum())
                assert part <= 4 / 20 * limits[k, row] + 1e-12
                if limits[k, row] > 1e-6:
                    tightest.append(length / limits[k, row])
    assert max(tightest) > 0.5  # the bound is not far from what moves


def test_a_single_revolute_joint_has_its_exact_reach(tmp_path: Path) -> None:
    """A point at 0.3 m from the axis, in a ball of 0.1 m: 0.4 m per radian, however the point lies along the axis."""
    (tmp_path / "robot.urdf").write_text(
        '<robot name="one"><link name="base"/><link name="arm"/><joint name="j" type="continuous"><parent link="base"/>'
        '<child link="arm"/><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><axis xyz="0 0 1"/></joint></robot>'
    )
    robot, _ = build_robot(RobotSpec(robot="one", description="robot.urdf"), file=tmp_path / "robot.yaml")
    bound = MotionBound(Kinematics(robot), [Mover(1, 0, np.array([0.0, 0.3, 0.7]), 0.1)])
    assert bound.reach == pytest.approx(np.array([[0.4]]))
    assert bound.along(np.array([0.2]), np.array([0.7]), 1) == pytest.approx(np.array([[0.5 * 0.4]]))
