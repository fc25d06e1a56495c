"""Joints that obey positions and velocities are drives, no puppets: effort limits, gravity and contact act on them, and
what they do depends on no rate. A link of 2 kg on a hinge, its centre 0.3 m out: 5.886 N m hold it level."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from manipcli.control.command import JointCommand, Mode
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.manager import ControllerManager
from manipcli.control.saturation import MotorLimits
from manipcli.control.stability import largest_velocity_gain
from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link, Mimic
from manipcli.model.robot import RobotModel
from manipcli.plan.trajectory import JointTrajectory
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry
from manipcli.simulate.engine import Engine, EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.engines.pybullet_motors import POSITION_TIME
from manipcli.simulate.session import Session
from manipcli.spec.controllers import GainsSpec

with_physics = pytest.mark.parametrize(
    "member", [member for member in ENGINES if member.physics == "full"], ids=lambda member: member.name
)
GRAVITY_EFFORT = 2.0 * 9.81 * 0.3
FREE = JointLimits(-3.0, 3.0, 100.0, 1000.0)


def robot(limits: JointLimits = FREE) -> RobotModel:
    """It lies level at 0, and gravity pulls it to positive angles."""
    beam = Geometry(Transform.of(xyz=(0.3, 0.0, 0.0)), Box((0.6, 0.04, 0.04)))
    inertial = Inertial(2.0, Transform.of(xyz=(0.3, 0.0, 0.0)), frozen(np.diag([0.001, 0.06, 0.06])))
    joint = Joint("hinge", "revolute", "base", "beam", Transform.of(xyz=(0, 0, 1)), frozen((0.0, 1.0, 0.0)), limits)
    links = (Link("base", None, (), ()), Link("beam", inertial, (), (beam,)))
    return RobotModel("testbot", "base", links, (joint,), (), (), (), Transform.identity(), "")


def obstacle(height: float) -> Body:
    """A fixed block whose top is at this height, below the end of the beam."""
    size = (0.2, 0.2, 0.2)
    return Body(
        name="block", kind="box", geometries=(Geometry(Transform.identity(), Box(size)),), mass=1.0,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3)), friction=0.0, rolling_friction=0.0, spinning_friction=0.0,
        restitution=0.0, fixed=True, X_WO=Transform.of(xyz=(0.5, 0.0, height - 0.1)), interior=None, size=frozen(size),
        centre=frozen((0.0, 0.0, 0.0)),
    )  # fmt: skip


def opened(
    member: EngineMember, limits: JointLimits = FREE, *, step: float = 1e-3, bodies: tuple[Body, ...] = ()
) -> Engine:
    scene = Scene(bodies, (), frozen((0.0, 0.0, -9.81)))
    return member.open(robot(limits), scene, EngineSettings(step, 1, np.zeros(1)))


def following(
    member: EngineMember, interface: str, gains: GainsSpec, *, rate: float | None = None, limits: JointLimits = FREE
) -> tuple[Session, JointTrajectoryController]:
    """A session in which a trajectory controller commands the hinge; the gains count on velocities alone."""
    arm = JointTrajectoryController(
        name="arm", joints=["hinge"], command_interfaces=[interface],
        gains={"hinge": gains} if interface == "velocity" else {}, limits=[limits], types=["revolute"],
    )  # fmt: skip
    manager = ControllerManager(joints=["hinge"], period=1e-3)
    manager.load(arm, update_rate=rate)
    manager.configure("arm")
    manager.switch(["arm"])
    scene = Scene((), (), frozen((0.0, 0.0, -9.81)))
    return Session(robot=robot(limits), scene=scene, engine=opened(member, limits), manager=manager, period=1e-3), arm


def way_to(angle: float) -> JointTrajectory:
    """From 0, in half a second, from rest to rest."""
    zero = np.zeros((2, 1))
    return JointTrajectory.of_arrays(("hinge",), np.array([0.0, 0.5]), np.array([[0.0], [angle]]), zero, zero)


def commanded(mode: Mode, value: float) -> JointCommand:
    command = JointCommand(1)
    command.obey([mode])
    (command.position if mode == "position" else command.velocity)[:] = value
    return command


def run(engine: Engine, command: JointCommand, ticks: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and effort after each tick."""
    rows = []
    for _ in range(ticks):
        engine.write(command)
        engine.advance()
        state = engine.read()
        rows.append((state.position[0], state.velocity[0], state.effort[0]))
    return tuple(np.array(rows).T)


@with_physics
@pytest.mark.parametrize("step", [5e-4, 1e-3, 2e-3])
def test_a_position_is_approached_with_one_time_constant_whatever_the_physics_step(
    member: EngineMember, step: float
) -> None:
    """Conformance 60, where the lag is a gain a cycle: 1 - exp(-t / tau). One step of lag is Bullet's, which solves for
    the velocity at the end of a step."""
    engine = opened(member, step=step)
    position, _, _ = run(engine, commanded("position", 0.01), round(0.1 / step))
    engine.close()
    times = step * np.arange(1, len(position) + 1)
    np.testing.assert_allclose(position, 0.01 * (1 - np.exp(-times / POSITION_TIME)), atol=1e-6)


@with_physics
@pytest.mark.parametrize("mode", ["position", "velocity"])
def test_nothing_jumps(member: EngineMember, mode: Mode) -> None:
    """Limits of 2 rad/s and 20 N m on 0.24 kg m^2 under gravity: at most 108 rad/s^2."""
    engine = opened(member, replace(FREE, velocity=2.0, effort=20.0))
    position, velocity, effort = run(engine, commanded(mode, 2.0), 100)
    engine.close()
    assert np.abs(effort).max() <= 20.0 + 1e-9
    assert np.abs(velocity).max() <= 2.0 + 1e-6
    most = (20.0 + GRAVITY_EFFORT) / (0.06 + 2.0 * 0.3**2)
    assert np.diff(velocity, prepend=0.0).max() <= 1.01 * most * 1e-3
    assert np.diff(position, prepend=0.0).max() <= 2.0 * 1e-3 + 1e-9


@with_physics
@pytest.mark.parametrize("mode", ["position", "velocity"])
def test_a_drive_that_is_too_weak_cannot_hold_the_link(member: EngineMember, mode: Mode) -> None:
    """Conformance 62: gravity acts on a joint that obeys positions, too."""
    weak, strong = opened(member, replace(FREE, effort=4.0)), opened(member, replace(FREE, effort=8.0))
    fallen, _, effort = run(weak, commanded(mode, 0.0), 500)
    held, _, holding = run(strong, commanded(mode, 0.0), 500)
    weak.close()
    strong.close()
    # From rest: 1/2 a t^2 with a = (5.886 - 4) N m / 0.24 kg m^2, a little less as it turns down.
    assert fallen[249] == pytest.approx(0.5 * (GRAVITY_EFFORT - 4.0) / 0.24 * 0.25**2, rel=0.05)
    np.testing.assert_allclose(effort[1:], -4.0, atol=1e-6)
    assert np.abs(held).max() < 1e-4
    assert holding[-1] == pytest.approx(-GRAVITY_EFFORT, rel=1e-3)


@with_physics
@pytest.mark.parametrize(("mode", "value"), [("position", 1.0), ("velocity", 1.0)])
def test_a_link_that_is_pressed_on_an_obstacle_does_not_pass(member: EngineMember, mode: Mode, value: float) -> None:
    """The top of the block is where the lower edge of the beam's end comes at 0.2 rad."""
    angle = 0.2
    height = 1.0 - 0.6 * math.sin(angle) - 0.02 * math.cos(angle)
    engine = opened(member, replace(FREE, effort=10.0, velocity=2.0), bodies=(obstacle(height),))
    position, velocity, effort = run(engine, commanded(mode, value), 1500)
    pressing = max(contact.force for contact in engine.contacts())
    engine.close()
    assert position[-1] == pytest.approx(angle, abs=0.01), "on the block, not in it"
    assert abs(velocity[-1]) < 1e-3
    assert effort[-1] == pytest.approx(10.0, abs=0.01), "as hard as it may"
    # What presses: the drive and the link's weight, at the lever of the contact.
    lever = (10.0 + GRAVITY_EFFORT * math.cos(angle)) / pressing
    assert lever == pytest.approx(0.6 * math.cos(angle) - 0.02 * math.sin(angle), rel=0.02)


@with_physics
@pytest.mark.parametrize("interface", ["position", "velocity"])
def test_what_a_controller_brings_about_does_not_depend_on_its_rate(member: EngineMember, interface: str) -> None:
    """Conformance 60. A quintic over half a second, updated at 1000, 500 and 250 Hz on the same physics: the same rest,
    and the same way but for the time that a slower one learns of it."""
    ways = {}
    for rate in (1000.0, 500.0, 250.0):
        session, arm = following(member, interface, GainsSpec(p=30.0, ff_velocity_scale=1.0), rate=rate)
        session.tick()
        handle = arm.send_goal(way_to(0.3))
        ways[rate] = np.array([session.tick().position[0] for _ in range(900)])
        session.engine.close()
        assert handle.status == "succeeded", handle.result
    peak = 0.3 * 1.875 / 0.5
    for rate, position in ways.items():
        assert position[-1] == pytest.approx(0.3, abs=1e-4), rate
        assert np.abs(position - ways[1000.0]).max() < peak * (1.0 / rate + 1e-3)


@with_physics
@pytest.mark.parametrize("d", [0.0, 0.3])
@pytest.mark.parametrize("rate", [1000.0, 500.0])
def test_a_velocity_loop_settles_up_to_the_gain_that_is_said_of_it(member: EngineMember, rate: float, d: float) -> None:
    """The engine has no delay that the bound does not know of."""
    most = largest_velocity_gain(d=d, period=1.0 / rate)
    for share, settles in ((0.95, True), (1.05, False)):
        gains = GainsSpec(p=share * most, d=d, ff_velocity_scale=1.0)
        session, arm = following(member, "velocity", gains, rate=rate)
        session.tick()
        arm.send_goal(way_to(0.3))
        position = np.array([session.tick().position[0] for _ in range(600)])
        session.engine.close()
        assert bool(np.abs(position[-50:] - 0.3).max() < 1e-6) is settles


@with_physics
@pytest.mark.parametrize("interface", ["position", "velocity"])
@pytest.mark.parametrize(("share", "counted"), [(0.9, 300), (1.1, 0)])
def test_a_motor_that_gives_all_it_may_is_counted(
    member: EngineMember, interface: str, share: float, counted: int
) -> None:
    limits = replace(FREE, effort=share * GRAVITY_EFFORT)
    session, _ = following(member, interface, GainsSpec(p=30.0), limits=limits)
    for _ in range(301):  # the first tick measures what was before it
        session.tick()
    session.engine.close()
    assert session.saturations[0] == pytest.approx(counted, abs=3)


def test_of_a_hand_that_presses_and_of_a_tick_that_is_counted_already_nothing_is_added() -> None:
    model = robot(replace(FREE, effort=2.0))
    full, counts = np.array([-2.0]), np.zeros(1, dtype=np.int64)
    motors = MotorLimits(model)
    motors.select(["effort"])
    assert not motors.watches
    motors.select(["position"])
    motors.count(full, np.array([True]), counts)
    assert counts.tolist() == [0]
    motors.count(full, np.array([False]), counts)
    assert counts.tolist() == [1]
    hand = MotorLimits(model, pressing={"hinge"})
    hand.select(["position"])
    assert not hand.watches


@with_physics
def test_a_follower_settles_where_its_driver_says_also_under_gravity(member: EngineMember) -> None:
    """Conformance 61: multiplier times the driver plus offset, and the same for velocities."""
    base, driver = robot().links, robot().joints[0]
    follower = replace(driver, name="follower", child="other", mimic=Mimic("hinge", -0.5, 0.2))
    pair = replace(robot(), links=(*base, replace(base[1], name="other")), joints=(driver, follower))
    pair = replace(pair, links=tuple(replace(link, collisions=()) for link in pair.links))
    engine = member.open(pair, Scene((), (), frozen((0.0, 0.0, -9.81))), EngineSettings(1e-3, 1, np.array([0.0, 0.2])))
    command = JointCommand(2)
    command.obey(["position", "free"])
    for tick in range(1000):
        command.position[0] = min(0.6, tick * 1e-3)
        engine.write(command)
        engine.advance()
        state = engine.read()
        assert state.position[1] == pytest.approx(-0.5 * state.position[0] + 0.2, abs=5e-4)
        if tick == 500:
            assert state.velocity.tolist() == pytest.approx([1.0, -0.5], abs=5e-3)
    engine.close()
    assert state.position.tolist() == pytest.approx([0.6, -0.1], abs=1e-4)


def test_nobody_commands_a_follower() -> None:
    """Conformance 61."""
    arm = JointTrajectoryController(name="arm", joints=["follower"], command_interfaces=["position"])
    manager = ControllerManager(joints=["hinge", "follower"], period=1e-3, following=["follower"])
    with pytest.raises(InvalidInput, match="follower"):
        manager.load(arm)
