"""`follow` of a joint that turns without end: whole turns do not count, as in ROS."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

Follow = Callable[[str], np.ndarray]


@pytest.fixture
def followed(pendulum: Callable[..., Path]) -> Follow:
    """(T, 2) positions of the joints `wheel`, without limits, and `hinge`, from 0.5 and 0 rad on."""
    folder = pendulum("poses: {zero: {all: [0]}, start: {spin: [0.5]}}\n")
    urdf = folder / "pendulum.urdf"
    wheel = """<link name="disc"><inertial><mass value="1"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0"
iyz="0"/></inertial></link><joint name="wheel" type="continuous"><parent link="base"/><child link="disc"/>
<origin xyz="0 1 0"/><axis xyz="0 0 1"/><limit velocity="3" effort="20"/></joint></robot>"""
    urdf.write_text(urdf.read_text().replace("</robot>", wheel))
    robot = folder / "robot.yaml"
    robot.write_text(robot.read_text().replace("groups: {", "groups: {spin: {joints: [wheel]}, "))
    (folder / "c.yaml").write_text("controllers: {c: {type: computed_torque, joints: [wheel, hinge]}}\n")

    def of(points: str) -> np.ndarray:
        (folder / "task.yaml").write_text(
            "task: t\nrobot: robot.yaml\ncontrollers: c.yaml\nstart: start\n"
            f"steps: [{{follow: {{joint_names: [wheel, hinge], points: [{points}]}}}}]\n"
        )
        (step,) = plan_task(load_task(folder / "task.yaml")).steps
        (motion,) = step.plan.motions
        assert motion.trajectory is not None
        return np.asarray(motion.trajectory.positions)

    return of


def test_the_first_point_is_reached_the_short_way_round(followed: Follow) -> None:
    way = followed(f"{{positions: [{0.7 + 2 * math.tau}, 0.3], time_from_start: 2}}")
    np.testing.assert_allclose(way[[0, -1]], [[0.5, 0.0], [0.7, 0.3]], atol=1e-9)
    assert np.diff(way[:, 0]).min() >= 0.0


def test_later_points_may_turn_as_often_as_they_say(followed: Follow) -> None:
    far = 0.7 + math.tau
    points = f"{{positions: [{far}, 0], time_from_start: 2}}, {{positions: [{far + 7}, 0], time_from_start: 6}}"
    way = followed(points)
    np.testing.assert_allclose(way[-1], [7.7, 0.0], atol=1e-9)


def test_a_first_point_at_once_may_be_whole_turns_away(followed: Follow) -> None:
    at_once = "{{positions: [{}, 0], time_from_start: 0}}, {{positions: [{}, 0], time_from_start: 2}}"
    way = followed(at_once.format(0.5 - math.tau, 1.0 - math.tau))
    np.testing.assert_allclose(way[[0, -1], 0], [0.5, 1.0], atol=1e-9)
    with pytest.raises(NotPlannable, match=r"joint 'wheel' at 0\.6000 rad, but the joint is at 0\.5000 rad"):
        followed(at_once.format(0.6 - math.tau, 1.0))
