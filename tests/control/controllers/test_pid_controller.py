"""The law of ros2_controllers' PidController, by hand: u = ff r + p e + I + d de/dt."""

import math

import numpy as np
import pytest

from manipcli.control.controller import JointState
from manipcli.control.controllers.pid import PidController, PidGainsSpec
from manipcli.core.errors import InvalidArgument

PERIOD = 0.01


def make(gains, *, joints=("a",), **more):
    return PidController(name="loop", joints=joints, gains=dict(zip(joints, gains, strict=True)), **more)


def at(position, velocity=0.0):
    return JointState(np.atleast_1d(float(position)), np.atleast_1d(float(velocity)), np.zeros(1))


def command(controller, state, k=0):
    return float(controller.update(k * PERIOD, PERIOD, state).command[0])


def test_with_one_interface_it_takes_the_derivative_itself():
    """e = 100: p e = 100, the integral comes a step late, d e / dt = 3 * 100 / 0.01 at first and 0 then."""
    controller = make([PidGainsSpec(p=1, i=2, d=3)])
    controller.set_reference([101.1])
    assert command(controller, at(1.1)) == pytest.approx(100 + 30000)
    assert command(controller, at(1.1), 1) == pytest.approx(100 + 2 * 100 * 0.01)
    assert command(controller, at(2.1), 2) == pytest.approx(99 + 2 * 2 * 100 * 0.01 - 3 * 1 / 0.01)


def test_ros_1_integrates_first_and_knows_no_derivative_at_first():
    controller = make([PidGainsSpec(p=1, i=2, d=3)], compat="ros1")
    controller.set_reference([101.1])
    assert command(controller, at(1.1)) == pytest.approx(100 + 2 * 100 * 0.01)


def test_with_two_interfaces_the_second_is_the_derivative_and_is_fed_forward():
    controller = make([PidGainsSpec(p=10, d=2, feedforward_gain=5)], led=("position", "velocity"))
    controller.set_reference([1.0], [0.4])
    assert command(controller, at(0.7, 0.1)) == pytest.approx(5 * 0.4 + 10 * 0.3 + 2 * 0.3)
    controller.set_reference([1.0])
    assert command(controller, at(0.7, 0.1)) == pytest.approx(10 * 0.3 - 2 * 0.1)


@pytest.mark.parametrize("led", [("position",), ("velocity",)])
def test_with_one_interface_the_reference_is_fed_forward(led):
    controller = make([PidGainsSpec(feedforward_gain=5)], led=led)
    controller.set_reference([0.6])
    assert command(controller, at(0.1, 0.2)) == pytest.approx(3.0)


def test_a_velocity_is_led():
    controller = make([PidGainsSpec(p=4)], led=("velocity",))
    controller.set_reference([0.5])
    output = controller.update(0.0, PERIOD, at(3.0, 0.2))
    assert output.command[0] == pytest.approx(4 * 0.3)
    assert (output.velocity[0], output.position[0]) == (0.5, pytest.approx(3.0 + 0.5 * PERIOD))


@pytest.mark.parametrize(
    ("wraps", "kind", "error"),
    [(True, "revolute", -0.2), (None, "continuous", -0.2), (False, "continuous", math.tau - 0.2),
     (None, "revolute", math.tau - 0.2)],
)  # fmt: skip
def test_an_endless_joint_takes_the_short_way(wraps, kind, error):
    controller = make([PidGainsSpec(p=1, angle_wraparound=wraps)], types=[kind])
    controller.set_reference([math.pi - 0.1])
    assert command(controller, at(-math.pi + 0.1)) == pytest.approx(error)


def test_it_holds_what_it_meets_or_waits_for_a_reference():
    holds, waits = (make([PidGainsSpec(p=2)], hold_first=first) for first in (True, False))
    assert (command(holds, at(1.0)), command(waits, at(1.0))) == (0.0, 0.0)
    assert (command(holds, at(0.5)), command(waits, at(0.5))) == (1.0, 0.0)
    waits.set_reference([1.0])
    assert command(waits, at(0.5)) == 1.0


@pytest.mark.parametrize(("saves", "term"), [(True, 0.5), (False, 0.0)])
def test_the_integral_outlives_a_deactivation_where_it_is_saved(saves, term):
    controller = make([PidGainsSpec(i=50, save_i_term=saves)])
    controller.set_reference([1.0])
    assert command(controller, at(0.0)) == 0.0
    assert command(controller, at(1.0)) == pytest.approx(0.5)  # 50 * 1 * 0.01
    controller.deactivate(1.0)
    assert command(controller, at(3.0)) == pytest.approx(term)


def test_it_brings_a_mass_to_its_reference():
    """m x'' = u with u = p e + d e': after ten time constants of the closed loop nothing is left."""
    controller = make([PidGainsSpec(p=100, d=20)], led=("position", "velocity"))
    controller.set_reference([0.7])
    x = v = 0.0
    for k in range(200):
        v += PERIOD * command(controller, at(x, v), k)
        x += PERIOD * v
    assert x == pytest.approx(0.7, abs=1e-6)


@pytest.mark.parametrize(
    ("gains", "more", "named"),
    [
        ({"a": PidGainsSpec()}, {}, "'a' are all zero"),
        ({}, {}, "'a' has no gains"),
        ({"a": PidGainsSpec(p=1), "z": PidGainsSpec(p=1)}, {}, "'z' has gains, but is not a joint of the controller"),
        ({"a": PidGainsSpec(p=1)}, {"led": ("velocity", "position")}, "cannot be controlled together"),
    ],
)
def test_what_would_not_work_is_refused(gains, more, named):
    with pytest.raises(InvalidArgument, match=named):
        PidController(name="loop", joints=("a",), gains=gains, **more)


def test_rates_are_for_two_interfaces():
    with pytest.raises(InvalidArgument, match="second interface"):
        make([PidGainsSpec(p=1)]).set_reference([1.0], [0.0])


def test_a_measurement_that_is_no_number_is_refused_by_name_and_costs_no_integral():
    controller = make([PidGainsSpec(i=50)])
    controller.set_reference([1.0])
    command(controller, at(0.0))
    with pytest.raises(InvalidArgument, match="position of joint 'a' is nan"):
        command(controller, at(np.nan), 1)
    assert command(controller, at(1.0), 2) == pytest.approx(0.5)


def test_on_positions_it_commands_the_reference_and_its_correction_and_holds_without_one():
    controller = make([PidGainsSpec(p=0.5, feedforward_gain=1)], interface="position", hold_first=False)
    assert command(controller, at(0.3)) == 0.3
    controller.set_reference([1.0])
    assert command(controller, at(0.8), 1) == pytest.approx(1.0 + 0.5 * 0.2)
