"""The inertia of rotors behind their gears, in Bullet and in the feed-forward alike; and damping that is stiff."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link, TransmissionTag
from manipcli.model.drivetrain import reflected_inertia
from manipcli.model.kinematics import Kinematics
from manipcli.model.normalised_urdf import engine_urdf
from manipcli.model.robot import Actuator, RobotModel
from manipcli.simulate.engines.pybullet import _library
from manipcli.simulate.engines.pybullet_rotor_inertia import add_rotor_inertia, stiff_damping

DT = 1e-3
TORQUE = np.array([3.0, 1.0])
GRAVITY = (0.0, 0.0, -9.81)


def pendulum(kind: Literal["revolute", "prismatic"], *rotors: float, reduction: float = 100.0) -> RobotModel:
    """Two links that hang, the first from a hinge or from a slide; rotors before gears of `reduction`."""

    def link(name: str, mass: float, length: float) -> Link:
        inertia = frozen(np.diag([0.01, 0.012, 0.005]) * mass)
        return Link(name, Inertial(mass, Transform.of(xyz=(0.0, 0.0, -length)), inertia), (), ())

    axis = (0.0, 1.0, 0.0) if kind == "revolute" else (0.0, 0.0, 1.0)
    limits = JointLimits(lower=-50.0, upper=50.0, velocity=100.0, effort=1000.0)
    joints = (
        Joint("j", kind, "base", "upper", Transform.identity(), frozen(axis), limits),
        Joint("k", "revolute", "upper", "lower", Transform.of(xyz=(0.0, 0.0, -1.0)), frozen((0.0, 1.0, 0.0)), limits),
    )
    tags = tuple(
        TransmissionTag(name, "SimpleTransmission", (name,), (1.0,), (0.0,), ("m" + name,), (reduction,))
        for name in "jk"
    )
    links = (Link("base", None, (), ()), link("upper", 1.0, 0.5), link("lower", 0.5, 0.3))
    actuators = tuple(Actuator("m" + name, rotor_inertia=value) for name, value in zip("jk", rotors, strict=True))
    return RobotModel("r", "base", links, joints, (), (), tags, Transform.identity(), "", actuators=actuators)


def damped(robot: RobotModel, *damping: float) -> RobotModel:
    joints = (replace(joint, damping=b) for joint, b in zip(robot.joints, damping, strict=True))
    return replace(robot, joints=tuple(joints))


def simulated(
    robot: RobotModel, folder: Path, seconds: float, torque: np.ndarray = TORQUE
) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity after constant torques, from rest at 0, in Bullet."""
    p = _library()
    client = p.connect(p.DIRECT)
    try:
        p.setGravity(*GRAVITY, physicsClientId=client)
        p.setPhysicsEngineParameter(fixedTimeStep=DT, numSolverIterations=50, physicsClientId=client)
        (folder / "r.urdf").write_text(engine_urdf(robot, folder), encoding="utf-8")
        flags = p.URDF_USE_INERTIA_FROM_FILE
        body = p.loadURDF(str(folder / "r.urdf"), useFixedBase=True, flags=flags, physicsClientId=client)
        for k in (0, 1):
            p.changeDynamics(body, k, linearDamping=0.0, angularDamping=0.0, physicsClientId=client)
            p.setJointMotorControl2(body, k, p.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        add_rotor_inertia(p, client, robot, body, [0, 1], step=DT)
        for _ in range(round(seconds / DT)):
            p.setJointMotorControlArray(body, [0, 1], p.TORQUE_CONTROL, forces=list(torque), physicsClientId=client)
            p.stepSimulation(client)
        states = p.getJointStates(body, [0, 1], client)
        return np.array([s[0] for s in states]), np.array([s[1] for s in states])
    finally:
        p.disconnect(client)


def integrated(robot: RobotModel, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """The same from M(q) a = tau - h(q, v), in steps ten times as small."""
    kinematics = Kinematics(robot, gravity=GRAVITY)
    B = np.array([joint.damping for joint in robot.joints])
    q, v, zero = np.zeros(2), np.zeros(2), np.zeros(2)
    for _ in range(round(seconds / DT * 10)):
        bias = kinematics.inverse_dynamics(q, v, zero).copy()
        v = v + DT / 10 * np.linalg.solve(kinematics.mass_matrix(q), TORQUE - bias - B * v)
        q = q + DT / 10 * v
    return q, v


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize("rotors", [(5e-5, 2e-5), (5e-4, 2e-4), (0.0, 2e-4)])
def test_a_joint_accelerates_its_rotor_too(
    tmp_path: Path, kind: Literal["revolute", "prismatic"], rotors: tuple[float, float]
) -> None:
    """Reflected inertias of a tenth to many times those of the links; the rest is Bullet's error at this step."""
    robot = pendulum(kind, *rotors)
    for ours, exact in zip(simulated(robot, tmp_path, 0.5), integrated(robot, 0.5), strict=True):
        np.testing.assert_allclose(ours, exact, atol=0.01 * np.abs(exact).max())


@pytest.mark.parametrize("damping", [900.0, 2500.0, 6000.0, 150000.0])
def test_a_slide_with_stiff_damping_comes_to_its_speed(tmp_path: Path, damping: float) -> None:
    """From 0.6 to 100 times as much as takes away all velocity in a step: v = (F - m g) / b (1 - exp(-b t / m))."""
    mass, seconds = 1.5, 20 * DT
    robot = damped(pendulum("prismatic", 0.0, 0.0), damping, 0.0)
    assert stiff_damping(robot, DT).tolist() == [damping, 0.0]
    q, v = simulated(robot, tmp_path, seconds, np.array([300.0, 0.0]))
    speed = (300.0 + mass * GRAVITY[2]) / damping
    gone = 1.0 - np.exp(-damping * seconds / mass)
    assert v[0] == pytest.approx(speed * gone, rel=1e-3)
    assert q[0] == pytest.approx(speed * (seconds - gone * mass / damping), abs=speed * DT)
    assert abs(q[1]) < 1e-6


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize("damping", [(20.0, 60.0), (0.0, 200.0), (900.0, 0.5)])
def test_joints_with_stiff_damping_move_as_in_smaller_steps(
    tmp_path: Path, kind: Literal["revolute", "prismatic"], damping: tuple[float, float]
) -> None:
    robot = damped(pendulum(kind, 0.0, 0.0), *damping)
    assert stiff_damping(robot, DT).any()
    for ours, exact in zip(simulated(robot, tmp_path, 0.2), integrated(robot, 0.2), strict=True):
        np.testing.assert_allclose(ours, exact, atol=0.01 * np.abs(exact).max())


def test_damping_that_takes_away_little_in_a_step_is_bullets_own() -> None:
    robot = damped(pendulum("revolute", 0.0, 0.0), 1.0, 0.5)
    assert not stiff_damping(robot, DT).any()
    assert stiff_damping(robot, 100 * DT).all()


def test_the_mass_matrix_holds_reduction_squared_times_the_rotor() -> None:
    with_rotors, without = pendulum("revolute", 5e-5, 2e-5), pendulum("revolute", 0.0, 0.0)
    np.testing.assert_allclose(reflected_inertia(with_rotors), (0.5, 0.2))
    q = np.array([0.3, -0.7])
    difference = Kinematics(with_rotors).mass_matrix(q) - Kinematics(without).mass_matrix(q)
    np.testing.assert_allclose(difference, np.diag((0.5, 0.2)), atol=1e-12)


def test_of_a_pair_the_rotors_count_by_the_squares_of_their_ways() -> None:
    """The kinetic energy of both rotors, found by moving one joint alone."""
    robot = pendulum("revolute", 0.0, 0.0)
    tag = TransmissionTag(
        "t", "DifferentialTransmission", ("j", "k"), (2.0, 3.0), (0.0, 0.0), ("a", "b"), (10.0, -20.0)
    )
    pair = RobotModel(
        "r", "base", robot.links, robot.joints, (), (), (tag,), Transform.identity(), "",
        actuators=(Actuator("a", rotor_inertia=1e-3), Actuator("b", rotor_inertia=2e-3)),
    )  # fmt: skip
    # velocity_a = (r1 (s1 v1 + s2 v2), r2 (s1 v1 - s2 v2))
    by_hand = [1e-3 * (10 * s) ** 2 + 2e-3 * (20 * s) ** 2 for s in (2.0, 3.0)]
    np.testing.assert_allclose(reflected_inertia(pair), by_hand)
