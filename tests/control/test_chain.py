"""Chained controllers: the commands of one are the references of another.

Oracle: both controllers by hand, the references of the second set from the commands of the first.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from manipcli.control import JointState, JointTrajectory, JointTrajectoryController, TrajectoryPoint
from manipcli.control.chain import chain_problem
from manipcli.control.controllers.forward_command import ForwardCommandController
from manipcli.control.controllers.joint_trajectory import JointTrajectorySpec
from manipcli.control.controllers.pid import PidController, PidSpec
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import InvalidArgument, InvalidInput

PERIOD = 0.01
JOINTS = ("a", "b")


def arm(**more):
    return JointTrajectoryController(name="arm", joints=("b", "a"), command_interfaces=("position", "velocity"), **more)


def inner(**more):
    gains = {"a": {"p": 3.0, "d": 0.5}, "b": {"p": 2.0, "i": 1.0}}
    return PidController(name="inner", joints=JOINTS, gains=gains, led=("position", "velocity"), **more)


def outer(**more):
    gains = {"a": {"p": 4.0}, "b": {"p": 5.0}}
    return PidController(name="outer", joints=JOINTS, gains=gains, interface="velocity", **more)


def state(k):
    """Joints that move by themselves."""
    q = np.array([0.1, -0.2]) + 0.01 * k
    return SimpleNamespace(position=q, velocity=np.full(2, 0.3), effort=np.zeros(2))


def goal():
    points = [TrajectoryPoint([0.4, 0.7], 0.2, [0.0, 0.1]), TrajectoryPoint([0.5, 0.5], 0.5, [0.0, 0.0])]
    return JointTrajectory(("b", "a"), points)


def managed(*controllers, joints=JOINTS):
    return ControllerManager(controllers, joints=joints, period=PERIOD)


def test_a_trajectory_leads_a_pid_in_any_order_of_joints_and_of_loading():
    for second_first in (False, True):
        chain = (arm(chained_to="inner"), inner())
        manager = managed(*(reversed(chain) if second_first else chain))
        assert manager.serving(JOINTS) is chain[0]
        assert [info.interfaces[0] for info in manager.list() if info.name == "arm"] == ["inner/b/position"]
        first, second = arm(), inner()
        for controller in (chain[0], first):
            controller.send_goal(goal())
        for k in range(60):
            now = state(k)
            reversed_now = JointState(now.position[::-1], now.velocity[::-1], now.effort)
            position, velocity = first.update(k * PERIOD, PERIOD, reversed_now).commands
            second.set_reference(position[::-1], velocity[::-1])
            expected = second.update(k * PERIOD, PERIOD, JointState(now.position, now.velocity, now.effort))
            command = manager.update(k * PERIOD, now)
            assert command.modes == ("effort", "effort")
            assert command.effort.tolist() == expected.command.tolist()


def test_a_pid_leads_a_pid_and_the_last_reference_is_held_when_its_leader_ends():
    speed = {"a": {"p": 7.0}, "b": {"p": 8.0}}

    def last(**more):
        return PidController(name="last", joints=JOINTS, gains=speed, led=("velocity",), **more)

    chain = (outer(chained_to="last"), last())
    manager, first, second = managed(*chain), outer(), last()
    for controller in (chain[0], first):
        controller.set_reference([1.0, 2.0])
    for k in range(20):
        now = state(k)
        measured = JointState(now.position, now.velocity, now.effort)
        second.set_reference(first.update(k * PERIOD, PERIOD, measured).command)
        expected = second.update(k * PERIOD, PERIOD, measured).command.tolist()
        assert manager.update(k * PERIOD, now).effort.tolist() == expected
    with pytest.raises(InvalidArgument, match="another controller commands its references"):
        chain[1].set_reference([0.0, 0.0])
    manager.switch(deactivate="outer")
    held = manager.update(1.0, state(0)).effort.tolist()
    assert manager.update(1.0 + PERIOD, state(0)).effort.tolist() == held


def test_both_are_active_or_neither():
    manager = managed(arm(chained_to="inner"), inner())
    assert not manager.switch(deactivate="inner").ok
    assert manager.switch(deactivate=["inner", "arm"]).ok
    assert not manager.switch(activate="arm").ok
    assert manager.switch(activate=["arm", "inner"]).ok
    assert manager.switch(deactivate="inner", strictness="best_effort").deactivated == ("inner", "arm")
    with pytest.raises(InvalidInput, match="references of 'inner', which is not active"):
        managed(arm(chained_to="inner"))
    forward = ForwardCommandController(name="raw", joints=JOINTS, interface="position", chained_to="inner")
    with pytest.raises(InvalidInput, match="both claim inner/a/position, inner/b/position"):
        managed(arm(chained_to="inner"), inner(), forward)


def test_a_follower_that_fails_stops_its_leader():
    follower = inner()
    manager = managed(arm(chained_to="inner"), follower)
    manager.update(0.0, state(0))
    follower._pid = None
    manager.update(PERIOD, state(1))
    assert {info.name: info.state for info in manager.list()} == {"arm": "inactive", "inner": "inactive"}
    assert manager.update(2 * PERIOD, state(2)).modes == ("brake", "brake")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"chained_to": "innr"}, "it commands the references of 'innr', which is not in the file or not supported"),
        ({"chained_to": "arm"}, "it commands the references of 'arm' of type `joint_trajectory`, which has none"),
        ({"joints": ["a"]}, "its joints are not those of 'inner': a, b"),
        ({"command_interfaces": ["velocity"]}, "it commands velocity, but the references of 'inner' are position"),
        ({"command_interfaces": ["position", "velocity"]}, "it commands position, velocity, but the references of"),
    ],
)
def test_what_cannot_be_chained_is_refused(change, message):
    spec = {"type": "joint_trajectory", "joints": ["a", "b"], "command_interfaces": ["position"], "chained_to": "inner"}
    gains = {"a": {"p": 1.0}, "b": {"p": 1.0}}
    every = {
        "arm": JointTrajectorySpec.model_validate({**spec, **change}),
        "inner": PidSpec.model_validate({"type": "pid", "joints": ["a", "b"], "gains": gains}),
    }
    problem = chain_problem("arm", every["arm"], every)
    assert problem is not None and problem[0].startswith(message)
    assert chain_problem("arm", JointTrajectorySpec.model_validate(spec), every) is None
    circle = {
        name: PidSpec.model_validate(
            {
                "type": "pid",
                "joints": ["a"],
                "gains": {"a": {"p": 1.0}},
                "command_interface": "position",
                "chained_to": other,
            }
        )
        for name, other in (("x", "y"), ("y", "x"))
    }
    assert chain_problem("x", circle["x"], circle)[0] == "it follows itself through 'y'"
