"""Laws of transmissions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.core.errors import InvalidInput
from manipcli.model.robot import TransmissionTag
from manipcli.model.transmission import Quantity, SimpleTransmission

REDUCTIONS = st.floats(0.01, 1000.0) | st.floats(-1000.0, -0.01)
OFFSETS = st.floats(-10.0, 10.0)
VALUES = st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=5).map(np.array)
QUANTITIES: tuple[Quantity, ...] = ("position", "velocity", "effort")


@given(REDUCTIONS, OFFSETS, VALUES)
def test_there_and_back_is_the_identity(reduction: float, offset: float, values: np.ndarray) -> None:
    transmission = SimpleTransmission(reduction=reduction, offset=offset)
    for quantity in QUANTITIES:
        there = transmission.actuator_to_joint(quantity, values)
        back = transmission.joint_to_actuator(quantity, there)
        # Adding the offset to a small joint position loses |offset| eps, which the reduction enlarges.
        np.testing.assert_allclose(back, values, rtol=1e-12, atol=abs(reduction) * (abs(offset) + 1) * 1e-14)


@given(REDUCTIONS, OFFSETS, VALUES)
def test_power_is_conserved(reduction: float, offset: float, values: np.ndarray) -> None:
    transmission = SimpleTransmission(reduction=reduction, offset=offset)
    effort, velocity = values, values[::-1]
    joint = transmission.actuator_to_joint("effort", effort) * transmission.actuator_to_joint("velocity", velocity)
    np.testing.assert_allclose(joint, effort * velocity, rtol=1e-12, atol=1e-300)


@given(REDUCTIONS, OFFSETS)
def test_velocity_is_the_derivative_of_position(reduction: float, offset: float) -> None:
    transmission = SimpleTransmission(reduction=reduction, offset=offset)
    q = transmission.actuator_to_joint("position", np.array([0.0, 1.0]))
    rate = transmission.actuator_to_joint("velocity", np.array([1.0]))
    np.testing.assert_allclose(q[1] - q[0], rate[0], rtol=1e-9, atol=1e-13)


def test_reduction_scales_effort_up_and_velocity_down() -> None:
    gear = SimpleTransmission(reduction=50.0, offset=0.5)
    one = np.ones(1)
    assert gear.actuator_to_joint("effort", one)[0] == 50.0
    assert gear.actuator_to_joint("velocity", one)[0] == 0.02
    assert gear.actuator_to_joint("position", one)[0] == 0.52


@pytest.mark.parametrize("reduction", [0.0, -0.0, float("nan"), float("inf")])
def test_an_impossible_reduction_is_refused(reduction: float) -> None:
    with pytest.raises(InvalidInput, match="not possible"):
        SimpleTransmission(reduction=reduction)


def test_a_tag_with_two_joints_is_no_simple_transmission() -> None:
    tag = TransmissionTag("t", "SimpleTransmission", ("a", "b"), (1.0, 1.0), (0.0, 0.0), ("m",), (2.0,))
    with pytest.raises(InvalidInput, match="one joint"):
        SimpleTransmission.of(tag)
