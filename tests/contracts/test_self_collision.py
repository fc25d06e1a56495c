"""Links of the robot that collide with each other, in every engine with physics: laws of statics and of friction."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from manipcli.control.command import JointCommand, Mode
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, JointType, Link
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.shapes.primitives import Box, Geometry, Shape, Sphere
from manipcli.simulate.engine import Engine, EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES

Pairs = tuple[tuple[str, str], ...]
Opens = Callable[[EngineMember, RobotModel, Pairs], Engine]

with_physics = pytest.mark.parametrize(
    "member", [member for member in ENGINES if member.physics == "full"], ids=lambda member: member.name
)
LENGTH, RADIUS, APART = 0.5, 0.04, 0.2
"""[m] Of the fingers, of their tips, and between their hinges."""
AB, AC, BC = ((("a", "b"),), (("a", "c"),), (("b", "c"),))
TORQUE = 3.0
"""[N m]"""


@pytest.fixture
def opens() -> Iterator[Opens]:
    """Opens engines without gravity and scene, with all joints at 0; closed after the test."""
    opened: list[Engine] = []

    def open_engine(member: EngineMember, model: RobotModel, pairs: Pairs) -> Engine:
        start = frozen(np.zeros(len(model.joint_names)))
        settings = EngineSettings(1e-3, 1, start, self_collision=pairs)
        opened.append(member.open(model, Scene((), (), frozen((0.0, 0.0, 0.0))), settings))
        return opened[-1]

    yield open_engine
    for engine in opened:
        engine.close()


def robot(*joints: tuple[Joint, Shape, float], friction: float) -> RobotModel:
    """Links on a base, each with a joint, one shape at this height [m], and 1 kg there."""
    inertial = Inertial(1.0, Transform.identity(), frozen(np.eye(3) * 0.01))
    links = [Link("base", inertial, (), ())]
    for joint, shape, height in joints:
        X_LS = Transform.of(xyz=(0.0, 0.0, height))
        mass = Inertial(1.0, X_LS, frozen(np.eye(3) * 0.01))
        links.append(Link(joint.child, mass, (), (Geometry(X_LS, shape),)))
    made = tuple(joint for joint, _, _ in joints)
    return RobotModel("bot", "base", tuple(links), made, (), (), (), Transform.identity(), "", friction=friction)


def joint(name: str, kind: JointType, at: tuple[float, float, float], axis: tuple[float, float, float]) -> Joint:
    return Joint(name, kind, "base", name, Transform.of(xyz=at), frozen(axis), JointLimits(-3.0, 3.0, 50.0, 50.0))


def fingers() -> RobotModel:
    """Three upright fingers `a`, `b`, `c` on hinges along x, whose round tips have no friction; q > 0 tilts to +x."""
    made = [joint(name, "revolute", (k * APART, 0.0, 0.0), (0.0, 1.0, 0.0)) for k, name in enumerate("abc")]
    return robot(*((each, Sphere(RADIUS), LENGTH) for each in made), friction=0.0)


def drive(engine: Engine, modes: tuple[Mode, ...], efforts: tuple[float, ...], ticks: int) -> None:
    command = JointCommand(len(modes))
    command.obey(list(modes))
    command.effort[:] = efforts
    for _ in range(ticks):
        engine.write(command)
        engine.advance()


def tip(q: float, hinge: float) -> Array:
    return np.array([hinge + LENGTH * math.sin(q), 0.0, LENGTH * math.cos(q)])


@with_physics
def test_two_links_that_are_driven_together_press_with_torque_over_arm(member: EngineMember, opens: Opens) -> None:
    engine = opens(member, fingers(), AB)
    wrench = engine.sense_wrench("b")
    # Damped by hand: an undamped finger would bounce for a long time.
    command = JointCommand(3)
    command.obey(["effort", "brake", "brake"])
    for _ in range(1500):
        state = engine.read()
        command.effort[:] = TORQUE - 2.0 * state.velocity
        engine.write(command)
        engine.advance()
    state = engine.read()
    a, b = tip(state.position[0], 0.0), tip(state.position[1], APART)
    assert np.linalg.norm(b - a) == pytest.approx(2 * RADIUS, abs=1e-3)
    along = (b - a) / np.linalg.norm(b - a)
    arm = float(np.cross(a, along)[1])
    (contact,) = engine.contacts()
    assert (contact.a, contact.b) == ("robot/a", "robot/b")
    # The moment of the normal force and of friction about the hinge of `a` balances the torque there. The sensor at the
    # hinge of `b` measures what `a` pushes.
    pressed = np.sum([point.force * np.array(point.normal) for point in contact.points], axis=0)
    rubbed = np.sum([point.friction for point in contact.points], axis=0)
    np.testing.assert_allclose(pressed, -contact.force * along, atol=0.01 * contact.force)
    at = (a + b) / 2.0
    assert contact.force == pytest.approx((TORQUE + np.cross(at, rubbed)[1]) / arm, rel=5e-3)
    np.testing.assert_allclose(wrench[:3], -pressed - rubbed, atol=0.01 * contact.force)


@with_physics
def test_only_the_named_pairs_collide(member: EngineMember, opens: Opens) -> None:
    # `a` is driven towards `b` and, beyond it, `c`.
    stops: dict[Pairs, float] = {}
    for pairs in ((), AB, AC, BC):
        engine = opens(member, fingers(), pairs)
        drive(engine, ("effort", "brake", "brake"), (0.5, 0.0, 0.0), 1500)
        stops[pairs] = float(engine.read().position[0])
        assert all((touch.a[-1], touch.b[-1]) in pairs for touch in engine.contacts())
    # Equal fingers touch where their tips, on circles around two hinges, are two radii apart.
    assert np.linalg.norm(tip(stops[AB], 0.0) - tip(0.0, APART)) >= 2 * RADIUS - 2e-3
    assert stops[AB] < stops[AC]
    assert np.linalg.norm(tip(stops[AC], 0.0) - tip(0.0, 2 * APART)) >= 2 * RADIUS - 2e-3
    assert stops[()] == stops[BC] > 1.2


@with_physics
def test_links_have_the_product_of_their_frictions(member: EngineMember, opens: Opens) -> None:
    # `press` presses `slab` from above with 20 N, while 15 N push `slab` along x: a = (15 - 0.7^2 20) / 1 kg.
    above = joint("press", "prismatic", (0.0, 0.0, 0.0999), (0.0, 0.0, 1.0))
    slab = joint("slab", "prismatic", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    model = robot((above, Box((0.1, 0.1, 0.1)), 0.0), (slab, Box((2.0, 0.3, 0.1)), 0.0), friction=0.7)
    engine = opens(member, model, (("press", "slab"),))
    drive(engine, ("effort", "effort"), (-20.0, 9.0), 300)
    assert abs(engine.read().position[1]) < 1e-3  # below 9.8 N it sticks
    drive(engine, ("effort", "effort"), (-20.0, 15.0), 200)
    before = float(engine.read().velocity[1])
    drive(engine, ("effort", "effort"), (-20.0, 15.0), 200)
    assert (float(engine.read().velocity[1]) - before) / 0.2 == pytest.approx(15.0 - 0.49 * 20.0, rel=0.02)
    (contact,) = engine.contacts()
    assert contact.force == pytest.approx(20.0, rel=0.01)
