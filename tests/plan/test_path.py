from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.limit_check import verify
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path import follow_poses, interpolate, joint_path, linear_path
from manipcli.plan.pose_error import rotation_vector
from manipcli.plan.retimer import retime

ARM = tuple(f"joint_{k}" for k in range(1, 8))


@pytest.fixture(scope="module")
def solver(make_arm7: Callable[..., RobotModel]) -> InverseKinematics:
    return InverseKinematics(Kinematics(make_arm7()), ARM, "link_7", X_LT=Transform.of(xyz=(0.0, 0.0, 0.1)))


def test_interpolation_is_uniform_in_position_and_angle() -> None:
    A = Transform.of(xyz=(0.0, 0.0, 0.0), rpy=(0.1, 0.2, 0.3))
    B = A @ Transform.of(xyz=(0.03, 0.04, 0.0), rpy=(0.0, 0.0, 0.5))
    poses = interpolate(A, B)
    steps = [np.linalg.norm(b.p - a.p) for a, b in pairwise(poses)]
    turns = [np.linalg.norm(rotation_vector(a.R.T @ b.R)) for a, b in pairwise(poses)]
    assert len(poses) == 26  # 0.5 rad in steps of 0.02; 50 mm in steps of 5 need only 10
    np.testing.assert_allclose(steps, 0.05 / 25)
    np.testing.assert_allclose(turns, 0.02)
    assert poses[0] is A
    assert poses[-1] is B


def test_the_tool_stays_on_its_straight_line_also_between_the_points(
    solver: InverseKinematics, middle: Array, make_arm7: Callable[..., RobotModel]
) -> None:
    """Judged by forward kinematics at every tick of the timed motion: off the line by far less than 0.1 mm."""
    start = solver.forward(middle)
    goal = Transform(R=start.R @ Transform.of(rpy=(0.4, 0.0, 0.0)).R, p=start.p + np.array([-0.1, 0.15, -0.12]))
    path = linear_path(solver, middle, goal)
    limits = MotionLimits.of(make_arm7(), ARM)
    motion = retime(path, limits, period=1e-3)
    verify(motion, limits)
    along = (goal.p - start.p) / np.linalg.norm(goal.p - start.p)
    q = middle.copy()
    for positions in motion.positions[::20]:
        q[:7] = positions
        offset = solver.forward(q).p - start.p
        assert np.linalg.norm(offset - along * (along @ offset)) < 5e-5
    q[:7] = motion.positions[-1]
    np.testing.assert_allclose(solver.forward(q).p, goal.p, atol=1e-5)


def test_a_line_out_of_reach_says_how_far_it_goes(solver: InverseKinematics, middle: Array) -> None:
    start = solver.forward(middle)
    beyond = Transform(R=start.R, p=start.p + np.array([1.5, 0.0, 0.0]))
    with pytest.raises(NotPlannable, match=r"tool's path is unreachable after \d+ mm: the nearest pose is"):
        follow_poses(solver, middle, interpolate(start, beyond))


def test_a_line_whose_end_is_out_of_reach_says_so_with_its_distance(solver: InverseKinematics, middle: Array) -> None:
    """The nearest point is about that of many configurations drawn at random."""
    start = solver.forward(middle)
    beyond = Transform(R=start.R, p=start.p + np.array([3.0, 0.0, 0.0]))
    distance = float(np.linalg.norm(beyond.p - solver.base.p))
    with pytest.raises(NotPlannable, match=f"is out of reach: {distance:.3f} m from the robot's base") as refused:
        linear_path(solver, middle, beyond)
    off = float(refused.value.cause.rpartition("point is ")[2].split()[0]) / 1000.0
    drawn = solver.random_configurations(middle, np.random.default_rng(1), 2000)
    nearest = min(float(np.linalg.norm(solver.forward(q).p - beyond.p)) for q in drawn)
    assert nearest - 0.3 < off < nearest + 0.05


def test_a_turn_beyond_a_limit_names_the_joint(make_arm7: Callable[..., RobotModel], middle: Array) -> None:
    """About the last joint's axis the tool turns from 0.2 to the limit at 3.0 rad: 160 degrees."""
    solver = InverseKinematics(Kinematics(make_arm7()), ("joint_7",), "link_7")
    start = solver.forward(middle)
    poses = [start @ Transform.of(rpy=(0.0, 0.0, angle)) for angle in np.arange(0.0, 3.2, 0.02)]
    with pytest.raises(NotPlannable, match=r"0 mm and 16\d deg: .*limits of joint_7"):
        follow_poses(solver, middle, poses)


def test_a_jump_between_two_poses_is_refused_with_its_joint(solver: InverseKinematics, middle: Array) -> None:
    far = middle.copy()
    far[6] += 0.6
    with pytest.raises(NotPlannable, match=r"joint 'joint_7' would jump by 0\.4\d rad after "):
        follow_poses(solver, middle, [solver.forward(middle), solver.forward(far)])


def test_a_joint_path_merges_equal_neighbours() -> None:
    path = joint_path([[0.0], [0.0], [1.0], [1.0], [0.0]])
    np.testing.assert_array_equal(path, [[0.0], [1.0], [0.0]])
