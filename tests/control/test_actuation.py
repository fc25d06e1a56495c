"""What actuators make of effort commands."""

from __future__ import annotations

import dataclasses
import itertools
import timeit
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.control.actuation import STIFFNESS, Actuation
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link, TransmissionTag
from manipcli.model.kinematics import Kinematics
from manipcli.model.motor_limits import motor_effort_limits
from manipcli.model.robot import Actuator, RobotModel

PERIOD = 1e-3
ZERO = np.zeros(3)


def robot(*actuators: Actuator, pair: bool = False, joints: int = 3) -> RobotModel:
    """Joints j0, j1, ... in a chain, each with a gear of 10 to m0, m1, ...; or j0 alone and j1, j2 in a differential of
    reductions (10, 20) and (2, 4)."""
    inertial = Inertial(1.0, Transform.of(xyz=(0.0, 0.0, 0.1)), frozen(np.eye(3) * 0.02))
    links = tuple(Link(f"l{k}", inertial, (), ()) for k in range(joints + 1))
    chain = tuple(
        Joint(
            f"j{k}", "revolute", f"l{k}", f"l{k + 1}", Transform.of(xyz=(0.0, 0.0, 0.2)), frozen((0.0, 1.0, 0.0)),
            JointLimits(effort=100.0),
        )
        for k in range(joints)
    )  # fmt: skip
    tags = [
        TransmissionTag(f"t{k}", "SimpleTransmission", (f"j{k}",), (1.0,), (0.0,), (f"m{k}",), (10.0,))
        for k in range(1 if pair else joints)
    ]
    if pair:
        tags.append(
            TransmissionTag(
                "w", "DifferentialTransmission", ("j1", "j2"), (2.0, 4.0), (0.0, 0.0), ("m1", "m2"), (10.0, 20.0)
            )
        )
    return RobotModel("r", "l0", links, chain, (), (), tuple(tags), Transform.identity(), "", actuators=actuators)


def motors(**what: Any) -> tuple[Actuator, ...]:
    return tuple(Actuator(f"m{k}", **what) for k in range(3))


def test_ideal_actuators_give_the_command_back_itself() -> None:
    actuation = Actuation(robot(), PERIOD)
    command = np.array([1.0, 2.0, 3.0])
    assert actuation.ideal
    assert actuation.apply(command, ZERO, ZERO) is command
    assert Actuation(robot(*motors(rotor_inertia=1e-4)), PERIOD).ideal


def test_an_effort_that_every_actuator_has_passes_untouched() -> None:
    actuation = Actuation(robot(*motors(effort=2.0)), PERIOD)
    command = np.array([20.0, -20.0, 3.0])
    assert actuation.apply(command, ZERO, ZERO) is command
    assert not actuation.saturations.any()


def test_the_limit_of_an_actuator_cuts_at_the_joint_reduction_times_it() -> None:
    actuation = Actuation(robot(Actuator("m1", effort=2.0)), PERIOD)
    for tick in range(3):
        applied = actuation.apply(np.array([50.0, 50.0, -50.0]), ZERO, ZERO)
        np.testing.assert_allclose(applied, (50.0, 20.0, -50.0))
        assert actuation.saturations.tolist() == [0, tick + 1, 0]
    actuation.apply(np.array([50.0, 5.0, -50.0]), ZERO, ZERO)
    assert actuation.saturated.tolist() == [False, False, False]
    assert actuation.saturations.tolist() == [0, 3, 0]
    actuation.reset()
    assert not actuation.saturations.any()


@given(st.tuples(*[st.floats(-200.0, 200.0)] * 3))
def test_a_pair_saturates_at_the_actuators_and_not_at_the_joints(command: tuple[float, float, float]) -> None:
    """By hand: a = ((j1 / s1 + j2 / s2) / (2 r1), (j1 / s1 - j2 / s2) / (2 r2)), cut, and back."""
    actuation = Actuation(robot(Actuator("m1", effort=1.0), Actuator("m2", effort=0.5), pair=True), PERIOD)
    j0, j1, j2 = command
    a1 = np.clip((j1 / 2 + j2 / 4) / 20, -1.0, 1.0)
    a2 = np.clip((j1 / 2 - j2 / 4) / 40, -0.5, 0.5)
    expected = (j0, 2 * (10 * a1 + 20 * a2), 4 * (10 * a1 - 20 * a2))
    np.testing.assert_allclose(actuation.apply(np.array(command), ZERO, ZERO), expected, atol=1e-10)


def test_beyond_its_velocity_limit_a_motor_only_brakes() -> None:
    """Actuators turn ten times as fast as joints."""
    actuation = Actuation(robot(*motors(velocity=30.0)), PERIOD)
    fast, slow = np.array([3.1, -3.1, 3.1]), np.array([2.9, -2.9, 2.9])
    command = np.array([5.0, -5.0, -5.0])
    assert actuation.apply(command, ZERO, slow) is command
    np.testing.assert_allclose(actuation.apply(command, ZERO, fast), (0.0, 0.0, -5.0))
    assert actuation.saturations.tolist() == [1, 1, 0]


def test_a_command_becomes_effort_after_its_latency() -> None:
    """Before the first command there was one like it."""
    delays = (0, 1, 3)
    actuation = Actuation(robot(*(Actuator(f"m{k}", latency=delay) for k, delay in enumerate(delays))), PERIOD)
    applied = np.array([actuation.apply(np.full(3, 10.0 + tick), ZERO, ZERO).copy() for tick in range(12)])
    for k, delay in enumerate(delays):
        np.testing.assert_allclose(applied[:, k], 10.0 + np.maximum(np.arange(12) - delay, 0))
    actuation.reset()
    np.testing.assert_allclose(actuation.apply(np.full(3, 7.0), ZERO, ZERO), 7.0)


def test_friction_opposes_the_motion_and_stands_behind_the_gear() -> None:
    """Away from rest: tau n - n (b v n + c), with a gear of n = 10."""
    actuation = Actuation(robot(*motors(viscous_friction=1e-5, coulomb_friction=0.02)), PERIOD)
    velocity = np.array([2.0, -2.0, 0.0])
    applied = actuation.apply(np.full(3, 5.0), ZERO, velocity)
    loss = 10 * (1e-5 * 20 + 0.02)
    np.testing.assert_allclose(applied, (5.0 - loss, 5.0 + loss, 5.0), rtol=1e-3)  # b as in an implicit step


def test_efficiency_is_lost_where_the_motor_drives_and_helps_where_it_brakes() -> None:
    actuation = Actuation(robot(*motors(efficiency=0.8)), PERIOD)
    velocity = np.array([2.0, -2.0, 0.0])
    np.testing.assert_allclose(actuation.apply(np.full(3, 5.0), ZERO, velocity), (4.0, 6.0, 5.0))


@given(st.tuples(*[st.floats(-50.0, 50.0)] * 3), st.tuples(*[st.floats(-5.0, 5.0)] * 3))
def test_friction_and_losses_take_power_and_never_give_it(
    command: tuple[float, float, float], velocity: tuple[float, float, float]
) -> None:
    actuation = Actuation(
        robot(*motors(viscous_friction=1e-4, coulomb_friction=0.01, efficiency=0.7), pair=True), PERIOD
    )
    v, tau = np.array(velocity), np.array(command)
    assert actuation.apply(tau, ZERO, v) @ v <= tau @ v + 1e-9


def test_friction_brings_a_joint_to_rest_without_chatter() -> None:
    """Each tick takes away a share of the velocity and never turns it, though c alone would, many times over."""
    model = robot(*motors(coulomb_friction=5.0, viscous_friction=0.5, rotor_inertia=1e-6))
    actuation, kinematics = Actuation(model, PERIOD), Kinematics(model, gravity=(0.0, 0.0, 0.0))
    M = kinematics.mass_matrix(ZERO)
    assert 10 * 5.0 * PERIOD / M[2, 2] > 1.0  # [rad/s] what Coulomb friction alone does in a tick
    v = np.array([1e-3, -1e-3, 2e-3])
    energies = []
    for _ in range(200):
        v = v + PERIOD * np.linalg.solve(M, actuation.apply(ZERO, ZERO, v))
        energies.append(v @ M @ v)
    assert all(later <= earlier for earlier, later in itertools.pairwise(energies))
    assert energies[-1] < 1e-3 * energies[0]


def test_a_load_below_the_friction_makes_a_joint_creep_and_no_more() -> None:
    model = robot(*motors(coulomb_friction=1.0))
    actuation = Actuation(model, PERIOD)
    M = Kinematics(model, gravity=(0.0, 0.0, 0.0)).mass_matrix(ZERO)
    mobility = np.abs(np.linalg.inv(M)).sum(axis=1) * 100  # at the actuators, which turn ten times as fast
    creep = 0.5 * mobility * PERIOD / STIFFNESS / 10  # under a load of 0.5 at the actuator, seen at the joint
    np.testing.assert_allclose(actuation.apply(np.full(3, 5.0), ZERO, creep), 0.0, atol=1e-9)


def test_what_is_commanded_otherwise_is_left_alone() -> None:
    """Case 13: a quantity that only one side has stays as it was, at 13.37."""
    actuation = Actuation(robot(*motors(effort=1.0)), PERIOD)
    actuation.select(["effort", "position", None])
    np.testing.assert_allclose(actuation.apply(np.full(3, 13.37), ZERO, ZERO), (10.0, 13.37, 13.37))
    assert actuation.saturations.tolist() == [1, 0, 0]
    actuation.select(["velocity", "effort", "effort"])
    np.testing.assert_allclose(actuation.apply(np.full(3, 13.37), ZERO, ZERO), (13.37, 10.0, 10.0))


def test_of_a_pair_both_joints_are_commanded_by_effort_or_none_goes_through_its_actuators() -> None:
    actuation = Actuation(robot(*motors(effort=0.1), pair=True), PERIOD)
    actuation.select(["position", "effort", "position"])
    command = np.array([5.0, 40.0, 5.0])
    np.testing.assert_allclose(actuation.apply(command, ZERO, ZERO), command)


def test_a_joint_without_a_transmission_keeps_its_effort() -> None:
    bare = dataclasses.replace(robot(Actuator("m0", effort=1.0)), transmissions=robot().transmissions[:1])
    np.testing.assert_allclose(Actuation(bare, PERIOD).apply(np.full(3, 50.0), ZERO, ZERO), (10.0, 50.0, 50.0))


def test_motors_of_an_engine_are_capped_by_actuator_and_joint() -> None:
    """n (efficiency limit - c), and no more than the joint bears; without limits that of the joint."""
    limited = robot(Actuator("m0", effort=2.0, efficiency=0.9, coulomb_friction=0.1), Actuator("m1", effort=50.0))
    np.testing.assert_allclose(motor_effort_limits(limited), (17.0, 100.0, 100.0))
    free = dataclasses.replace(
        limited, joints=tuple(dataclasses.replace(joint, limits=JointLimits()) for joint in limited.joints)
    )
    np.testing.assert_allclose(motor_effort_limits(free), (17.0, 500.0, np.inf))


def test_what_an_engine_may_apply_to_a_pair_is_within_both_actuators() -> None:
    """In every corner of the box, and in one of them an actuator is at its limit."""
    model = robot(Actuator("m1", effort=1.0), Actuator("m2", effort=0.5), pair=True)
    actuation = Actuation(model, PERIOD)
    caps = motor_effort_limits(model)
    corners = np.array([(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]) * caps[1:]
    efforts = actuation.drivetrain.transmission.blocks[1].joint_to_actuator("effort", corners)
    use: Array = np.abs(efforts).max(axis=0) / (1.0, 0.5)
    assert use.max() == pytest.approx(1.0)


def test_thirteen_limited_actuators_cost_microseconds() -> None:
    """A bound with room for a busy machine; it is 2.5 us on a quiet one."""
    many = robot(*(Actuator(f"m{k}", effort=2.0, velocity=300.0) for k in range(13)), joints=13)
    actuation = Actuation(many, PERIOD)
    command, q, v = np.full(13, 19.0), np.zeros(13), np.full(13, 0.1)
    assert actuation.apply(command, q, v) is command
    best = min(timeit.repeat(lambda: actuation.apply(command, q, v), number=500, repeat=10)) / 500
    assert best < 20e-6
