"""Timed lines of the tool where a joint comes to its limit on the way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.line import timed_line
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path import joint_path, linear_path

ARM = tuple(f"joint_{k}" for k in range(1, 8))


@pytest.fixture(scope="module")
def solver(make_arm7: Callable[..., RobotModel]) -> InverseKinematics:
    return InverseKinematics(Kinematics(make_arm7()), ARM, "link_7", X_LT=Transform.of(xyz=(0.0, 0.0, 0.1)))


@pytest.mark.parametrize(
    ("begin", "way"),
    [
        ((-0.8, 0.4, -0.6, 0.5, 0.9, -1.9, 1.7), (-0.2, 0.0, -0.2)),
        ((-2.8, 0.9, -1.0, 1.7, -2.3, 0.7, 1.9), (0.1, 0.1, 0.0)),
    ],
)
def test_a_line_along_a_joint_limit_stays_inside_and_straight(
    solver: InverseKinematics,
    make_arm7: Callable[..., RobotModel],
    begin: tuple[float, ...],
    way: tuple[float, ...],
) -> None:
    """The arm has a joint to spare: one that comes to its limit rests there, and the tool stays on its line."""
    limits = MotionLimits.of(make_arm7(), ARM)
    q = np.array([*begin, 0.0, 0.0])
    start = solver.forward(q)
    goal = Transform(R=start.R, p=start.p + np.array(way))
    motion = timed_line(lambda within: linear_path(within, q, goal), solver, limits, period=1e-3, insist=True)
    slack = np.minimum(motion.positions - limits.lower, limits.upper - motion.positions)
    assert slack.min() >= 0.0
    assert slack.min() < 0.01  # one does come to its limit
    along = (goal.p - start.p) / np.linalg.norm(goal.p - start.p)
    for positions in motion.positions[::20]:
        q[:7] = positions
        reached = solver.forward(q)
        offset = reached.p - start.p
        assert np.linalg.norm(offset - along * (along @ offset)) < 3e-4
        assert np.abs(reached.R - start.R).max() < 1e-3
    np.testing.assert_allclose(reached.p, goal.p, atol=0.005)
    np.testing.assert_allclose(solver.forward(np.array([*motion.positions[-1], 0.0, 0.0])).p, goal.p, atol=1e-5)


def test_a_line_for_which_a_joint_is_missing_tells_the_limit(make_arm7: Callable[..., RobotModel]) -> None:
    """Two joints that only just swing over: no other one can take their part."""
    robot = make_arm7()
    solver = InverseKinematics(Kinematics(robot), ("joint_6", "joint_7"), "link_7")
    limits = MotionLimits.of(robot, solver.joints)
    corner = np.array([[0.8, 0.2], [1.4, 0.2], [2.0, 0.2], [1.4, 0.8]])

    def walk(within: InverseKinematics) -> Array:
        if within is not solver:
            raise NotPlannable("the straight line is unreachable")
        return joint_path(corner)

    with pytest.raises(NotPlannable, match=r"joint 'joint_6' goes to 2\.\d+ rad .* beyond its upper limit 2\."):
        timed_line(walk, solver, limits, period=1e-3, insist=True)
