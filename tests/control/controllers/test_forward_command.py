"""Commands are passed on, and nothing else happens."""

import numpy as np
import pytest

from manipcli.control.controller import JointState
from manipcli.control.controllers.forward_command import ForwardCommandController
from manipcli.core.errors import InvalidArgument

PERIOD = 0.002
HERE = np.array([0.3, -0.1])


def make(interface):
    return ForwardCommandController(name="arm", joints=("a", "b"), interface=interface)


def measured(position=HERE, velocity=(0.5, 0.25)):
    return JointState(np.array(position), np.array(velocity), np.zeros(2))


@pytest.mark.parametrize(("interface", "held"), [("position", HERE), ("velocity", [0, 0]), ("effort", [0, 0])])
def test_until_it_is_told_it_holds_what_was_measured_first(interface, held):
    controller = make(interface)
    assert controller.update(0.0, PERIOD, measured()).command == pytest.approx(held)
    assert controller.update(PERIOD, PERIOD, measured([9.0, 9.0])).command == pytest.approx(held)


@pytest.mark.parametrize("interface", ["position", "velocity", "effort"])
def test_what_it_is_told_is_commanded_until_it_is_told_otherwise_or_deactivated(interface):
    controller = make(interface)
    values = np.array([0.4, -2.0])
    controller.set_command(values)
    values[:] = 7.0  # a copy was taken
    for k in range(3):
        assert controller.update(k * PERIOD, PERIOD, measured()).command.tolist() == [0.4, -2.0]
    controller.set_command([1, 2])
    assert controller.update(0.1, PERIOD, measured()).command.tolist() == [1.0, 2.0]
    controller.deactivate(0.2)
    held = HERE.tolist() if interface == "position" else [0.0, 0.0]
    assert controller.update(0.3, PERIOD, measured()).command.tolist() == held


@pytest.mark.parametrize("told", [None, [0.4, -2.0]])
def test_a_position_is_its_own_reference(told):
    """What an ideal engine moves to, and a log shows."""
    controller = make("position")
    if told is not None:
        controller.set_command(told)
    for position in (HERE, [9.0, 9.0]):
        output = controller.update(0.0, PERIOD, measured(position))
        assert output.position.tolist() == (HERE.tolist() if told is None else told)


def test_a_velocity_is_a_reference_one_period_ahead():
    """What makes an ideal engine move at the commanded velocity."""
    controller = make("velocity")
    controller.set_command([1.0, -3.0])
    output = controller.update(0.0, PERIOD, measured())
    assert output.velocity.tolist() == [1.0, -3.0]
    assert output.position == pytest.approx(HERE + PERIOD * np.array([1.0, -3.0]), abs=1e-15)


@pytest.mark.parametrize("values", [[1.0], [1.0, 2.0, 3.0], [[1.0, 2.0]], [1.0, np.nan], [np.inf, 0.0]])
def test_what_is_no_number_a_joint_is_refused_and_changes_nothing(values):
    controller = make("effort")
    controller.set_command([0.5, 0.5])
    with pytest.raises(InvalidArgument, match=r"arm.*(b|a|2)"):
        controller.set_command(values)
    assert controller.update(0.0, PERIOD, measured()).command.tolist() == [0.5, 0.5]


@pytest.mark.parametrize("joints", [(), ("a", "a")])
def test_joints_must_be_distinct(joints):
    with pytest.raises(InvalidArgument, match="distinct"):
        ForwardCommandController(name="arm", joints=joints, interface="effort")
