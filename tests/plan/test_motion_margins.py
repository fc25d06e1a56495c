from __future__ import annotations

import numpy as np
import pytest

from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.plan.motion_margins import limits_used, nearest_limits
from manipcli.plan.trajectory import JointTrajectory


def robot(*, velocity: float, acceleration: float, jerk: float | None) -> RobotModel:
    limits = JointLimits(-9.0, 9.0, velocity, 1.0, acceleration, jerk)
    joint = Joint("j", "revolute", "a", "b", Transform.identity(), frozen((0, 0, 1)), limits)
    links = tuple(Link(name=name, inertial=None, visuals=(), collisions=()) for name in ("a", "b"))
    return RobotModel("r", "a", links, (joint,), (), (), (), Transform.identity(), "")


def cosine() -> JointTrajectory:
    """q = 1 - cos(t) over one turn: velocity, acceleration and jerk all reach 1."""
    t = np.linspace(0.0, 2 * np.pi, 2001)
    columns = [values[:, None] for values in (1 - np.cos(t), np.sin(t), np.cos(t))]
    return JointTrajectory.of_arrays(("j",), t, *columns)


@pytest.mark.parametrize(
    ("velocity", "acceleration", "jerk", "nearest"),
    [
        (2.0, 3.0, 4.0, "velocity"),
        (3.0, 2.0, 4.0, "acceleration"),
        (4.0, 3.0, 2.0, "jerk"),
        (2.0, 3.0, None, "velocity"),
    ],
)
def test_the_nearest_limit_is_the_one_used_most(
    velocity: float, acceleration: float, jerk: float | None, nearest: str
) -> None:
    used = tuple(limits_used(robot(velocity=velocity, acceleration=acceleration, jerk=jerk), cosine()))
    found = max(nearest_limits(used, cosine().times), key=lambda margin: margin.used)
    assert (found.joint, found.quantity) == ("j", nearest)
    assert found.used == pytest.approx(0.5, rel=1e-5)  # differences of neighbours, 3 ms apart


def test_points_without_derivatives_say_nothing_of_limits() -> None:
    bare = JointTrajectory.of_arrays(("j",), np.array([0.0, 1.0]), np.array([[0.0], [1.0]]))
    used = limits_used(robot(velocity=1.0, acceleration=1.0, jerk=1.0), bare)
    assert [each.quantity for each in used] == ["position"]
