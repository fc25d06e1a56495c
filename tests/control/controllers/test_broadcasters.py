"""Broadcasters tell what they are given, and claim nothing."""

import numpy as np
import pytest

from manipcli.control.controller import JointState
from manipcli.control.controllers.force_torque_broadcaster import ForceTorqueBroadcaster
from manipcli.control.controllers.joint_state_broadcaster import JointStateBroadcaster
from manipcli.control.factory import build_controllers
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.spec.load import load_controllers_text
from manipcli.task.vocabulary import controllers_spec

PERIOD = 0.001


def world(position, velocity, effort):
    none = np.zeros((0, 3))
    return WorldState(np.zeros(()), position, velocity, effort, none, np.zeros((0, 4)), none, none)


def test_joint_states_are_those_of_the_last_update():
    broadcaster = JointStateBroadcaster(name="joints", joints=("c", "a"), state_interfaces=("position", "effort"))
    manager = ControllerManager([broadcaster], joints=("a", "b", "c"), period=PERIOD)
    assert (manager.list()[0].claimed, manager.command.modes) == ((), ("brake",) * 3)
    position, velocity, effort = np.array([1.0, 2, 3]), np.array([4.0, 5, 6]), np.array([7.0, 8, 9])
    manager.update(0.25, world(position, velocity, effort))
    state = broadcaster.state
    position[:] = 0.0  # what was told stays
    assert (state.time, state.names) == (0.25, ("c", "a"))
    assert (state.position.tolist(), state.velocity.tolist(), state.effort.tolist()) == ([3, 1], [], [9, 7])
    assert not state.position.flags.writeable


@pytest.mark.parametrize(("written", "joints"), [("", ("a", "b")), (", joints: [b]", ("b",))])
def test_of_a_file_it_tells_the_joints_that_are_stated_else_all(written, joints):
    spec = load_controllers_text(
        f"controllers: {{one: {{type: joint_state_broadcaster{written}}}}}", "c.yaml", model=controllers_spec()
    ).spec
    links = tuple(Link(name, None, (), ()) for name in ("base", "a_link", "b_link"))
    hinges = tuple(
        Joint(name, "revolute", "base", f"{name}_link", Transform.identity(), frozen([0, 0, 1]), JointLimits())
        for name in ("a", "b")
    )
    robot = RobotModel("r", "base", links, hinges, (), (), (), Transform.identity(), "")
    manager = build_controllers(spec, robot, PERIOD)
    manager.update(0.0, world(np.array([1.0, 2]), np.zeros(2), np.zeros(2)))
    state = manager["one"].state
    assert (state.names, state.position.tolist()) == (joints, [1.0, 2.0] if len(joints) == 2 else [2.0])


def test_a_broadcaster_may_be_slower_than_the_loop():
    broadcaster = JointStateBroadcaster(name="joints", joints=("a",))
    manager = ControllerManager(joints=("a",), period=PERIOD)
    manager.load(broadcaster, update_rate=250.0)
    manager.configure("joints")
    manager.switch(activate=["joints"])
    seen = []
    for k in range(8):
        manager.update(k * PERIOD, world(np.array([float(k)]), np.zeros(1), np.zeros(1)))
        seen.append(broadcaster.state.position[0])
    assert seen == [0, 0, 0, 0, 4, 4, 4, 4]


def test_only_what_is_measured_can_be_broadcast():
    with pytest.raises(InvalidArgument, match="acceleration"):
        JointStateBroadcaster(name="joints", joints=("a",), state_interfaces=("acceleration",))
    with pytest.raises(InvalidArgument, match="distinct"):
        JointStateBroadcaster(name="joints", joints=("a", "a"))


def test_a_wrench_is_that_of_the_last_update():
    broadcaster = ForceTorqueBroadcaster(name="sensor", link="palm", joint="mount")
    source = np.arange(1.0, 7.0)
    broadcaster.attach([source])
    nothing = JointState(np.zeros(0), np.zeros(0), np.zeros(0))
    assert not broadcaster.wrench.force.any()
    broadcaster.update(0.5, PERIOD, nothing)
    source[:] = 0.0
    wrench = broadcaster.wrench
    assert (wrench.time, wrench.link) == (0.5, "palm")
    assert (wrench.force.tolist(), wrench.torque.tolist()) == ([1, 2, 3], [4, 5, 6])
