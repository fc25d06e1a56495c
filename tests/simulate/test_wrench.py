"""Force/torque sensors against statics: what hangs on a joint pulls with its weight, wherever it is measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from manipcli.control.command import JointCommand, Mode
from manipcli.control.controllers.force_torque_broadcaster import ForceTorqueBroadcaster
from manipcli.control.controllers.forward_command import ForwardCommandController
from manipcli.control.manager import ControllerManager
from manipcli.core.geometry import Array, Transform, cross, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, JointType, Link, Mimic, TransmissionTag
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import Actuator, RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry, Sphere
from manipcli.simulate.engine import Engine, EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.session import Session

STEP = 1e-3
with_physics = pytest.mark.parametrize(
    "member", [member for member in ENGINES if member.physics == "full"], ids=lambda member: member.name
)
G = np.array([0.0, 0.0, -9.81])
MASSES = {"upper": 1.5, "wrist": 0.4, "tray": 0.8}
COM = {"upper": (0.1, 0.02, -0.03), "wrist": (0.03, 0.0, 0.01), "tray": (0.05, -0.04, 0.02)}


def _joint(name: str, kind: JointType, parent: str, child: str, X: Transform, axis: Sequence[float]) -> Joint:
    return Joint(name, kind, parent, child, X, frozen(axis), JointLimits(-3.0, 3.0, 5.0, 200.0))


def robot(driven: JointType) -> RobotModel:
    """A driven joint, a fixed one that carries a wrist and, on another fixed one, a tray; inertial frames turned."""
    turned = Transform.of(xyz=(0.0, 0.0, 1.0), rpy=(0.3, -0.4, 0.7))
    joints = (
        _joint("drive", driven, "base", "upper", turned, (0.0, 0.6, 0.8)),
        _joint("mount", "fixed", "upper", "wrist", Transform.of(xyz=(0.3, 0.1, 0.0), rpy=(-0.5, 0.9, 0.2)), (1, 0, 0)),
        _joint("glue", "fixed", "wrist", "tray", Transform.of(xyz=(0.1, 0.0, 0.0)), (1, 0, 0)),
    )
    tensor = frozen([[0.01, 0.002, 0.001], [0.002, 0.012, -0.001], [0.001, -0.001, 0.015]])
    links = [Link("base", None, (), ())]
    for name, mass in MASSES.items():
        links.append(Link(name, Inertial(mass, Transform.of(xyz=COM[name], rpy=(0.2, 0.1, -0.6)), tensor), (), ()))
    return RobotModel("testbot", "base", tuple(links), joints, (), (), (), Transform.identity(), "")


def scene(*bodies: Body) -> Scene:
    return Scene(bodies, (), frozen(G))


def expected(model: RobotModel, q: Array, link: str, extra: Sequence[tuple[float, Array]] = ()) -> Array:
    """(6) the weight of everything from `link` on, and of `extra` (mass, place in the world), by the lever rule."""
    kinematics = Kinematics(model)
    X_WL = kinematics.forward(q, link)
    weights = list(extra)
    for name in sorted(model.descendants(link)):
        X = kinematics.forward(q, name)
        weights.append((MASSES[name], X.R @ np.array(COM[name]) + X.p))
    force = sum((m * G for m, _ in weights), np.zeros(3))
    torque = sum((cross(np.asarray(p - X_WL.p), m * G) for m, p in weights), np.zeros(3))
    return np.concatenate([X_WL.R.T @ force, X_WL.R.T @ torque])


def settled(engine: Engine, sensors: Sequence[Array], mode: Mode, effort: float = 0.0) -> tuple[Array, list[Array]]:
    """The joint's position and what was measured after a second of holding still."""
    command = JointCommand(1)
    command.obey((mode,))
    command.position[:] = engine.read().position
    command.effort[:] = effort
    for _ in range(1000):
        engine.write(command)
        engine.advance()
        state = engine.read()
    assert abs(state.velocity[0]) < 1e-6
    return np.array(state.position), [np.array(sensor) for sensor in sensors]


@with_physics
@pytest.mark.parametrize("driven", ["revolute", "prismatic", "continuous"])
@pytest.mark.parametrize("mode", ["position", "velocity", "brake"])
def test_what_hangs_at_rest_pulls_with_its_weight(member: EngineMember, driven: JointType, mode: Mode) -> None:
    model = robot(driven)
    engine = member.open(model, scene(), EngineSettings(STEP, 1, frozen([0.4])))
    try:
        sensors = [engine.sense_wrench(joint) for joint in ("drive", "mount", "glue")]
        assert not np.array(sensors).any()
        q, measured = settled(engine, sensors, mode)
    finally:
        engine.close()
    for link, wrench in zip(("upper", "wrist", "tray"), measured, strict=True):
        np.testing.assert_allclose(wrench, expected(model, q, link), atol=2e-3)  # the motor's solver leaves so much


@with_physics
def test_an_effort_is_measured_along_its_own_axis(member: EngineMember) -> None:
    """The reaction along the axis of a driven joint is the effort that holds it."""
    model = robot("revolute")
    q = np.array([0.4])
    holds = float(Kinematics(model, gravity=tuple(G)).gravity(q)[0])
    engine = member.open(model, scene(), EngineSettings(STEP, 1, frozen(q)))
    try:
        sensor = engine.sense_wrench("drive")
        command = JointCommand(1)
        command.obey(("effort",))
        command.effort[:] = holds
        engine.write(command)
        engine.advance()
        engine.read()
    finally:
        engine.close()
    assert sensor[3:] @ np.array([0.0, 0.6, 0.8]) == pytest.approx(-holds, abs=1e-6)
    np.testing.assert_allclose(sensor, expected(model, q, "upper"), atol=1e-3)


def _body(shape: Sphere | Box, mass: float, at: Sequence[float], *, rolls: float = 0.0) -> Body:
    """About 10 cm across."""
    return Body(
        name="body", kind="sphere" if isinstance(shape, Sphere) else "box",
        geometries=(Geometry(Transform.identity(), shape),), mass=mass, X_OI=Transform.identity(),
        inertia=frozen(np.eye(3) * 0.4 * mass * 0.05**2), friction=0.8, rolling_friction=rolls,
        spinning_friction=rolls, restitution=0.0, fixed=False, X_WO=Transform.of(xyz=at), interior=None,
        size=frozen([0.1] * 3), centre=frozen(np.zeros(3)),
    )  # fmt: skip


@with_physics
def test_what_lies_on_a_link_is_measured_through_the_contact(member: EngineMember) -> None:
    """A ball of 2 kg on a level tray, whose own mass is 0.8 kg."""
    slide = _joint("drive", "prismatic", "base", "carriage", Transform.of(xyz=(0.0, 0.0, 1.0)), (0.0, 0.0, 1.0))
    glue = _joint("glue", "fixed", "carriage", "tray", Transform.of(xyz=(0.2, 0.0, 0.0)), (1, 0, 0))
    plate = Geometry(Transform.identity(), Box((0.4, 0.4, 0.02)))
    solid = Inertial(0.8, Transform.identity(), frozen(np.eye(3) * 0.01))
    links = (Link("base", None, (), ()), Link("carriage", solid, (), ()), Link("tray", solid, (plate,), (plate,)))
    model = RobotModel("lift", "base", links, (slide, glue), (), (), (), Transform.identity(), "")
    at = (0.25, 0.03, 1.06)
    engine = member.open(model, scene(_body(Sphere(0.05), 2.0, at, rolls=0.01)), EngineSettings(STEP, 1, frozen([0.0])))
    try:
        q, (wrench,) = settled(engine, [engine.sense_wrench("glue")], "position")
        ball = np.array(engine.read().body_position[0])
    finally:
        engine.close()
    arm = ball - np.array([0.2, 0.0, 1.0 + q[0]])
    np.testing.assert_allclose(wrench[:3], 2.8 * G, atol=2e-2)
    np.testing.assert_allclose(wrench[3:], cross(arm, 2.0 * G), atol=2e-3)


def _gripper() -> RobotModel:
    """Two fingers that close along y, the right one a mimic of the left; masses as little alike as their places."""
    pad = Geometry(Transform.identity(), Box((0.04, 0.02, 0.06)))
    links = [Link("base", None, (), ())]
    for name, mass in (("palm", 0.7), ("left", 0.2), ("right", 0.1)):
        shapes = () if name == "palm" else (pad,)
        inertial = Inertial(mass, Transform.identity(), frozen(np.eye(3) * 1e-3))
        links.append(Link(name, inertial, shapes, shapes))
    left = _joint("drive", "prismatic", "palm", "left", Transform.of(xyz=(0.3, -0.06, -0.1)), (0.0, 1.0, 0.0))
    right = _joint("follow", "prismatic", "palm", "right", Transform.of(xyz=(0.3, 0.06, -0.1)), (0.0, -1.0, 0.0))
    joints = (
        _joint("mount", "fixed", "base", "palm", Transform.of(xyz=(0.0, 0.0, 1.0)), (1, 0, 0)),
        left,
        replace(right, mimic=Mimic("drive", 1.0, 0.0)),
    )
    return RobotModel("gripper", "base", tuple(links), joints, (), (), (), Transform.identity(), "")


@with_physics
def test_what_couples_joints_and_the_grip_stay_inside_the_hand(member: EngineMember) -> None:
    """A hand that squeezes 0.5 kg with 20 N pulls with its weight and the block's; each finger with half the grip."""
    model, mass, grip = _gripper(), 0.5, 20.0
    block = _body(Box((0.1, 0.1, 0.1)), mass, (0.3, 0.0, 0.9))
    engine = member.open(model, scene(block), EngineSettings(STEP, 1, frozen([0.0, 0.0])))
    try:
        ticks = []
        palm, left, right = (engine.sense_wrench(joint) for joint in ("mount", "drive", "follow"))
        command = JointCommand(2)
        command.obey(("effort", "free"))
        command.effort[:] = (grip, 0.0)
        for _ in range(1500):
            engine.write(command)
            engine.advance()
            state = engine.read()
            ticks.append(np.array((palm, left, right)))
        held, (q_left, q_right) = np.array(state.body_position[0]), state.position
    finally:
        engine.close()
    assert held[2] == pytest.approx(0.9, abs=0.01)  # it is held
    palm, left, right = np.mean(ticks[-500:], axis=0)  # the solver shakes the pads by some mN
    np.testing.assert_allclose(palm[:3], 1.5 * G, atol=1e-2)
    fingers = np.array([[0.3, q_left - 0.06, -0.1], [0.3, 0.06 - q_right, -0.1]])
    arms = 0.2 * fingers[0] + 0.1 * fingers[1] + mass * (held - np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(palm[3:], cross(arms, G), atol=1e-3)
    assert left[1] == pytest.approx(-grip / 2, abs=0.1)
    assert right[1] == pytest.approx(grip / 2, abs=0.1)
    assert left[2] + right[2] == pytest.approx(-0.8 * 9.81, abs=1e-2)


@with_physics
@pytest.mark.parametrize("substeps", [1, 4])
def test_a_link_that_moves_pulls_with_what_accelerates_it(member: EngineMember, substeps: int) -> None:
    """Of a pendulum with a rotor, f = m (g - a) where a = q'' x r + q' x (q' x r) from the joint's motion."""
    hinge = _joint("drive", "continuous", "base", "upper", Transform.of(xyz=(0.0, 0.0, 1.0)), (0.0, 1.0, 0.0))
    mass, inertia, rotor = 1.5, 0.02, 0.4
    solid = Inertial(mass, Transform.of(xyz=(0.0, 0.0, -0.5)), frozen(np.eye(3) * inertia))
    links = (Link("base", None, (), ()), Link("upper", solid, (), ()))
    tag = TransmissionTag("t", "SimpleTransmission", ("drive",), (1.0,), (0.0,), ("m",), (10.0,))
    model = RobotModel(
        "pendulum", "base", links, (hinge,), (), (), (tag,), Transform.identity(), "",
        actuators=(Actuator("m", rotor_inertia=rotor / 100.0),),
    )  # fmt: skip
    engine = member.open(model, scene(), EngineSettings(STEP, substeps, frozen([0.6])))
    torque, axis = 12.0, np.array([0.0, 1.0, 0.0])
    speeds, wrenches, angles = [], [], []
    try:
        sensor = engine.sense_wrench("drive")
        command = JointCommand(1)
        command.obey(("effort",))
        command.effort[:] = torque
        for _ in range(152):
            engine.write(command)
            engine.advance()
            state = engine.read()
            speeds.append(float(state.velocity[0]))
            angles.append(float(state.position[0]))
            wrenches.append(sensor.copy())
    finally:
        engine.close()
    k, period = 150, STEP * substeps
    faster = (speeds[k + 1] - speeds[k - 1]) / (2 * period)
    assert abs(faster) > 1.0 < abs(speeds[k])
    r = np.array([0.0, 0.0, -0.5])
    a = faster * cross(axis, r) + speeds[k] ** 2 * cross(axis, cross(axis, r))
    R = Transform.of(rpy=(0.0, angles[k], 0.0)).R
    np.testing.assert_allclose(wrenches[k][:3], mass * (R.T @ G - a), atol=0.05)
    assert wrenches[k][4] == pytest.approx(-(torque - rotor * faster), abs=0.02)  # the rotor takes its share


@with_physics
def test_a_session_attaches_the_broadcaster_and_an_ideal_engine_feels_nothing(member: EngineMember) -> None:
    model = robot("revolute")
    for name in (member.name, "kinematic"):
        engine = ENGINES[name].open(model, scene(), EngineSettings(STEP, 1, frozen([0.4])))
        sensor = ForceTorqueBroadcaster(name="sensor", link="wrist", joint="mount")
        hold = ForwardCommandController(name="hold", joints=("drive",), interface="position")
        manager = ControllerManager([hold, sensor], joints=model.joint_names, period=STEP)
        session = Session(robot=model, scene=scene(), engine=engine, manager=manager, period=STEP)
        try:
            for _ in range(300):
                state = session.tick()
        finally:
            engine.close()
        wrench = sensor.wrench
        measured = np.concatenate([wrench.force, wrench.torque])
        assert wrench.time == pytest.approx(0.299)
        assert (wrench.link, wrench.force.flags.writeable) == ("wrist", False)
        wanted = np.zeros(6) if name == "kinematic" else expected(model, state.position, "wrist")
        np.testing.assert_allclose(measured, wanted, atol=5e-3)
