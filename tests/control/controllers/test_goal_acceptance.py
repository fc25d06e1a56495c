"""Which goals a controller takes: of an inactive one, before the first update, with points of different fields."""

import numpy as np
import pytest

from manipcli.control import GoalRejected, JointState, JointTrajectory, JointTrajectoryController, TrajectoryPoint
from manipcli.control.action import ErrorCode, GripperGoal
from manipcli.control.controllers.computed_torque import ComputedTorqueController
from manipcli.control.controllers.gripper import GripperController
from manipcli.control.manager import ControllerManager
from manipcli.description.elements import JointLimits

PERIOD = 0.01


def made(**more):
    return JointTrajectoryController(name="arm", joints=("j",), command_interfaces=("position",), **more)


def at(position, time, velocity=None):
    return TrajectoryPoint([position], time, None if velocity is None else [velocity])


def to(*points):
    return JointTrajectory(("j",), points)


def state(position=0.0):
    return JointState(np.array([position]), np.zeros(1), np.zeros(1))


@pytest.mark.parametrize(
    ("controller", "goal"),
    [
        (made(), to(at(0.1, 1.0))),
        (ComputedTorqueController(name="arm", joints=("j",)), to(at(0.1, 1.0))),
        (GripperController(name="arm", joints=("j",), interface="position"), GripperGoal(0.1)),
    ],
)
def test_only_an_active_controller_takes_goals(controller, goal):
    manager = ControllerManager([controller], joints=("j",), period=PERIOD)
    handle = controller.send_goal(goal)
    manager.switch(deactivate="arm")
    assert handle.result.code == ErrorCode.INVALID_GOAL
    with pytest.raises(GoalRejected, match="'arm' is not active"):
        controller.send_goal(goal)
    manager.switch(activate="arm")
    assert controller.send_goal(goal).active


def test_the_velocity_to_the_first_point_is_checked_before_the_first_update_too():
    """1 rad in 0.5 s at a limit of 1 rad/s cannot be followed from 0, but from 0.6."""
    for start, ends in ((0.0, True), (0.6, False)):
        controller = made(limits=[JointLimits(-2, 2, 1.0)])
        handle = controller.send_goal(to(at(1.0, 0.5)))
        output = controller.update(0.0, PERIOD, state(start))
        assert (not handle.active) == ends
        if ends:
            assert handle.result.code == ErrorCode.INVALID_GOAL
            assert "moves at 2 rad/s on the path to point 0; its limit is 1 rad/s" in handle.result.text
            assert output.position[0] == output.command[0] == start


def test_points_with_and_without_velocities_are_joined_by_what_both_ends_give():
    """From rest to 1 at 1 s (line), 2 with 1 rad/s at 2 s (line), 2 at rest at 3 s (cubic: 2 + t - 2 t^2 + t^3)."""
    controller = made()
    handle = controller.send_goal(to(at(1.0, 1.0), at(2.0, 2.0, 1.0), at(2.0, 3.0, 0.0)))
    seen, output = [], None
    for k in range(302):
        position = 0.0 if output is None else output.command[0]  # the joint is where it was commanded a tick ago
        output = controller.update(k * PERIOD, PERIOD, state(position))
        seen.append(output.position[0])
    t = np.arange(100) * PERIOD
    assert seen[:100] == pytest.approx(t)
    assert seen[100:200] == pytest.approx(1.0 + t)
    assert seen[200:300] == pytest.approx(2.0 + t - 2.0 * t**2 + t**3)
    assert handle.status == "succeeded"


def test_lines_between_mixed_points_keep_the_velocity_limit():
    controller = made(limits=[JointLimits(-9, 9, 2.0)])
    with pytest.raises(GoalRejected, match="3 rad/s on the path to point 1"):
        controller.send_goal(to(at(0.0, 1.0, 0.0), at(3.0, 2.0), at(3.0, 3.0, 0.0)))
