"""Laws of transmissions, and the numbers of the conformance cases of ros_control and ros2_control."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.description.transmission import Quantity, Transmission
from manipcli.description.transmissions.differential import DifferentialTransmission
from manipcli.description.transmissions.four_bar import FourBarLinkageTransmission
from manipcli.description.transmissions.simple import SimpleTransmission
from manipcli.model.drivetrain import BlockTransmission

QUANTITIES: tuple[Quantity, ...] = ("position", "velocity", "effort")
REDUCTION = st.floats(0.01, 1000.0) | st.floats(-1000.0, -0.01)
OFFSET = st.floats(-10.0, 10.0)
PAIR_TYPES: tuple[Callable[..., Transmission], ...] = (DifferentialTransmission, FourBarLinkageTransmission)


@st.composite
def transmissions(draw: st.DrawFn) -> Transmission:
    """Any transmission that keeps power, of any type."""
    if draw(st.booleans()):
        return SimpleTransmission(draw(REDUCTION), draw(OFFSET))
    kind, pair = draw(st.sampled_from(PAIR_TYPES)), st.tuples(REDUCTION, REDUCTION)
    made: Transmission = kind(draw(pair), draw(pair), draw(st.tuples(OFFSET, OFFSET)))
    return made


def values(data: st.DataObject, transmission: Transmission) -> Array:
    k = transmission.size
    drawn: Array = np.array(data.draw(st.lists(st.floats(-1e3, 1e3), min_size=k, max_size=k)), dtype=np.float64)
    return drawn


def loss(transmission: Transmission, quantity: Quantity, given: Array) -> Array:
    """What rounding may cost there and back: eps times what is added up on the way."""
    maps = transmission.maps
    there, back = (
        (maps.joint_effort, maps.actuator_effort) if quantity == "effort" else (maps.joint_motion, maps.actuator_motion)
    )
    middle = np.abs(there) @ np.abs(given) + np.abs(maps.offset)
    return 1e-14 * (np.abs(back) @ middle) + 1e-300


@given(transmissions(), st.data())
def test_there_and_back_is_the_identity(transmission: Transmission, data: st.DataObject) -> None:
    given_values = values(data, transmission)
    for quantity in QUANTITIES:
        there = transmission.actuator_to_joint(quantity, given_values)
        back = transmission.joint_to_actuator(quantity, there)
        assert np.all(np.abs(back - given_values) <= loss(transmission, quantity, given_values))


@given(transmissions(), st.data())
def test_power_is_conserved(transmission: Transmission, data: st.DataObject) -> None:
    """Case 9: effort . velocity is the same on both sides."""
    effort, velocity = values(data, transmission), values(data, transmission)
    joint_effort = transmission.actuator_to_joint("effort", effort)
    joint_velocity = transmission.actuator_to_joint("velocity", velocity)
    scale = np.abs(transmission.maps.joint_effort) @ np.abs(effort)
    scale = scale @ (np.abs(transmission.maps.joint_motion) @ np.abs(velocity))
    assert abs(joint_effort @ joint_velocity - effort @ velocity) <= 1e-14 * scale + 1e-300


@given(transmissions())
def test_velocity_is_the_derivative_of_position(transmission: Transmission) -> None:
    for each in np.eye(transmission.size):
        moved = transmission.actuator_to_joint("position", each) - transmission.actuator_to_joint("position", 0 * each)
        rate = transmission.actuator_to_joint("velocity", each)
        np.testing.assert_allclose(moved, rate, rtol=1e-9, atol=1e-14)  # eps times an offset of up to 10


def test_the_four_bar_efforts_of_ros1_come_back_and_lose_power() -> None:
    """Its round trip is the identity, so only the balance of power shows what is wrong with it."""
    linkage = FourBarLinkageTransmission((10.0, -20.0), (-2.0, 4.0), compat="ros1")
    effort, velocity = np.array([3.0, 5.0]), np.array([1.0, 2.0])
    joint = linkage.actuator_to_joint("effort", effort)
    np.testing.assert_allclose(joint, [-60.0, 4 * (-100.0 + 60.0)])
    np.testing.assert_allclose(linkage.joint_to_actuator("effort", joint), effort)
    assert abs(joint @ linkage.actuator_to_joint("velocity", velocity) - effort @ velocity) > 1.0


@pytest.mark.parametrize("reduction", [0.0, -0.0, float("nan"), float("inf")])
@pytest.mark.parametrize("offset", [0.0, 1.0, -1.0])
def test_an_impossible_reduction_is_refused(reduction: float, offset: float) -> None:
    """Case 1: a reduction of 0 is refused whatever the offset."""
    with pytest.raises(InvalidArgument, match=r"reduction = .* not allowed"):
        SimpleTransmission(reduction=reduction, offset=offset)


@pytest.mark.parametrize(("reduction", "offset"), list(itertools.product((1.0, -1.0), repeat=2)))
def test_unit_reductions_of_either_sign_are_accepted(reduction: float, offset: float) -> None:
    """Case 1: (+-1, +-1)."""
    gear = SimpleTransmission(reduction, offset)
    assert (gear.reduction, gear.offset) == (reduction, offset)


def test_reduction_scales_effort_up_and_velocity_down() -> None:
    """Case 2: n = 10, offset 1, actuator at 1."""
    gear = SimpleTransmission(reduction=10.0, offset=1.0)
    assert gear.actuator_to_joint("effort", 1.0) == 10.0
    assert gear.actuator_to_joint("velocity", 1.0) == 0.1
    assert gear.actuator_to_joint("position", 1.0) == 1.1


@pytest.mark.parametrize(("n", "offset"), list(itertools.product((10.0, -10.0), (0.0, 1.0, -1.0))))
def test_round_trips_of_the_simple_transmission(n: float, offset: float) -> None:
    """Case 3: the identity for 1, 0 and -1."""
    gear = SimpleTransmission(n, offset)
    for quantity, value in itertools.product(QUANTITIES, (1.0, 0.0, -1.0)):
        back = gear.joint_to_actuator(quantity, gear.actuator_to_joint(quantity, value))
        assert back == pytest.approx(value, abs=1e-9)


def test_equal_actuators_of_a_differential_turn_one_joint_alone() -> None:
    """Case 4: the sum drives the first joint, the difference the second; offsets are the positions at rest."""
    wrist = DifferentialTransmission((10.0, 10.0), (2.0, 2.0))
    for actuators, effort, velocity in (
        ((10.0, 10.0), (400.0, 0.0), (0.5, 0.0)),
        ((10.0, -10.0), (0.0, 400.0), (0.0, 0.5)),
    ):
        np.testing.assert_allclose(wrist.actuator_to_joint("effort", actuators), effort, atol=1e-9)
        np.testing.assert_allclose(wrist.actuator_to_joint("velocity", actuators), velocity, atol=1e-9)
        np.testing.assert_allclose(wrist.actuator_to_joint("position", actuators), velocity, atol=1e-9)
    shifted = DifferentialTransmission((10.0, 10.0), (2.0, 2.0), (1.0, 1.0))
    np.testing.assert_allclose(shifted.actuator_to_joint("position", (0.0, 0.0)), (1.0, 1.0))


def test_a_differential_of_unlike_gears_with_signs() -> None:
    """Case 5."""
    wrist = DifferentialTransmission((10.0, -20.0), (-2.0, 4.0), (-2.0, 4.0))
    actuators = (3.0, 5.0)
    np.testing.assert_allclose(wrist.actuator_to_joint("effort", actuators), (140.0, 520.0), rtol=1e-12)
    np.testing.assert_allclose(wrist.actuator_to_joint("velocity", actuators), (-0.0125, 0.06875), rtol=1e-12)
    np.testing.assert_allclose(wrist.actuator_to_joint("position", actuators), (-2.0125, 4.06875), rtol=1e-12)


def test_the_second_actuator_of_a_four_bar_moves_the_second_joint_against_the_first() -> None:
    """Case 6."""
    linkage = FourBarLinkageTransmission((10.0, 10.0), (2.0, 2.0))
    for actuators, effort in (((5.0, 10.0), (200.0, 200.0)), ((0.0, 10.0), (100.0, 200.0))):
        np.testing.assert_allclose(linkage.actuator_to_joint("effort", actuators), effort, atol=1e-9)
    for actuators, velocity in (((10.0, 5.0), (0.5, 0.0)), ((0.0, 10.0), (0.0, 0.5))):
        np.testing.assert_allclose(linkage.actuator_to_joint("velocity", actuators), velocity, atol=1e-9)
        np.testing.assert_allclose(linkage.actuator_to_joint("position", actuators), velocity, atol=1e-9)


@pytest.mark.parametrize("kind", PAIR_TYPES)
def test_random_pairs_come_back_though_the_actuators_were_overwritten(kind: Callable[..., Transmission]) -> None:
    """Case 8: 100 random gears, 100 random inputs each, to 1e-5, with 1337.1337 in the actuators before."""
    rng = np.random.default_rng(8)
    for _ in range(100):
        gear = kind(*rng.uniform(-1000.0, 1000.0, (3, 2)))
        for quantity in QUANTITIES:
            start = rng.uniform(-1000.0, 1000.0, (100, 2))
            actuators = start.copy()
            joints = gear.actuator_to_joint(quantity, actuators)
            actuators[:] = 1337.1337
            actuators[:] = gear.joint_to_actuator(quantity, joints)
            np.testing.assert_allclose(actuators, start, atol=1e-5)


@pytest.mark.parametrize("kind", PAIR_TYPES)
@pytest.mark.parametrize("field", ["actuator_reduction", "joint_reduction"])
@pytest.mark.parametrize(
    ("bad", "why"),
    [((0.0, 1.0), "= 0 is not"), ((1.0, 0.0), "= 0 is not"), ((1.0,), "has 1 number; expected 2"), (5.0, "expected 2")],
)
def test_a_pair_refuses_a_zero_and_a_wrong_count(
    kind: Callable[..., Transmission], field: str, bad: object, why: str
) -> None:
    """Case 10: any single 0, or a vector of one."""
    numbers: dict[str, object] = {"actuator_reduction": (1.0, 1.0), "joint_reduction": (1.0, 1.0), field: bad}
    with pytest.raises(InvalidArgument, match=f"{field} .*{why}"):
        kind(**numbers)


def test_offsets_of_pairs_are_two_finite_numbers() -> None:
    with pytest.raises(InvalidArgument, match="joint_offset has 3 numbers; expected 2"):
        DifferentialTransmission((1.0, 1.0), joint_offset=(0.0, 0.0, 0.0))
    with pytest.raises(InvalidArgument, match="joint_offset = nan"):
        FourBarLinkageTransmission((1.0, 1.0), joint_offset=(0.0, float("nan")))


def test_values_run_over_actuators_along_the_last_axis() -> None:
    """Leading axes stay; a single actuator takes any shape; a pair takes no other last axis than two."""
    wrist = DifferentialTransmission((3.0, 4.0), (2.0, 1.0), (0.1, 0.2))
    many = np.random.default_rng(0).normal(size=(3, 5, 2))
    mapped = wrist.actuator_to_joint("position", many)
    assert mapped.shape == many.shape
    np.testing.assert_allclose(mapped[2, 4], wrist.actuator_to_joint("position", many[2, 4]), rtol=1e-12)
    gear = SimpleTransmission(2.0, 1.0)
    for shape in ((), (1,), (3,), (4, 1)):
        assert gear.joint_to_actuator("position", np.full(shape, 2.0)).shape == shape
    assert gear.actuator_to_joint("effort", [1, 2]).tolist() == [2.0, 4.0]
    for wrong in (1.0, [1.0], np.zeros((2, 3))):
        with pytest.raises(InvalidArgument, match="expected 2 along the last axis"):
            wrist.joint_to_actuator("effort", wrong)


def test_an_unknown_quantity_is_refused() -> None:
    with pytest.raises(InvalidArgument, match="unknown quantity 'torq'"):
        SimpleTransmission().actuator_to_joint("torq", 1.0)  # type: ignore[arg-type]
    with pytest.raises(InvalidArgument, match="expected ros1 or ros2"):
        FourBarLinkageTransmission((1.0, 1.0), compat="ros3")  # type: ignore[arg-type]


@given(st.lists(transmissions(), min_size=1, max_size=4), st.data())
def test_blocks_side_by_side_map_as_each_alone(members: list[Transmission], data: st.DataObject) -> None:
    """One product with a block matrix is what the transmissions do one by one."""
    whole = BlockTransmission(tuple(members))
    given_values = values(data, whole)
    ends = np.cumsum([member.size for member in members])[:-1]
    for quantity in QUANTITIES:
        for direction in ("actuator_to_joint", "joint_to_actuator"):
            parts = [
                getattr(member, direction)(quantity, part)
                for member, part in zip(members, np.split(given_values, ends), strict=True)
            ]
            mapped = getattr(whole, direction)(quantity, given_values)
            np.testing.assert_allclose(mapped, np.concatenate(parts), rtol=1e-9, atol=1e-6)
