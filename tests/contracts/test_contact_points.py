"""Where parts touch and with what forces: laws of statics for the contact points of every engine with physics."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from manipcli.control.command import JointCommand
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry
from manipcli.simulate.engine import Engine, EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES

G = 9.81
MASS, HALF = 1.5, (0.1, 0.08, 0.05)
"""[kg], [m]: of the block."""
WEIGHT = MASS * G

with_physics = pytest.mark.parametrize(
    "member", [member for member in ENGINES if member.physics == "full"], ids=lambda member: member.name
)
# The names of the block and of what it lies on, and which of them is first in the scene: the contact's sides follow the
# names, those of an engine its own order.
in_any_order = pytest.mark.parametrize(("block", "support"), [("block", "table"), ("thing", "table")])
first_or_last = pytest.mark.parametrize("block_first", [True, False])

Opens = Callable[..., Engine]


@pytest.fixture
def opens() -> Iterator[Opens]:
    """Opens an engine with these bodies and a pad of 1 kg on a slide along x, which presses with its command."""
    opened: list[Engine] = []

    def open_engine(member: EngineMember, *bodies: Body) -> Engine:
        pad = Geometry(Transform.identity(), Box((0.1, 0.1, 0.1)))
        inertial = Inertial(1.0, Transform.identity(), frozen(np.eye(3) * 0.01))
        slide = Joint(
            "slide", "prismatic", "base", "pad", Transform.of(xyz=(0.0, 0.0, 1.0)), frozen((1.0, 0.0, 0.0)),
            JointLimits(-4.0, 4.0, 5.0, 50.0),
        )  # fmt: skip
        links = (Link("base", inertial, (), ()), Link("pad", inertial, (), (pad,)))
        model = RobotModel("presser", "base", links, (slide,), (), (), (), Transform.identity(), "")
        engine = member.open(
            model, Scene(bodies, (), frozen((0.0, 0.0, -G))), EngineSettings(1e-3, 1, frozen(np.zeros(1)))
        )
        opened.append(engine)
        return engine

    yield open_engine
    for engine in opened:
        engine.close()


def body(name: str, half: tuple[float, ...], at: Array, *, slope: float = 0.0, fixed: bool, friction: float) -> Body:
    box = Box((2 * half[0], 2 * half[1], 2 * half[2]))
    x, y, z = (MASS / 3.0 * (np.dot(half, half) - h**2) for h in half)
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), box),), mass=0.0 if fixed else MASS,
        X_OI=Transform.identity(), inertia=frozen(np.diag((x, y, z))), friction=friction, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=fixed, X_WO=Transform.of(xyz=at, rpy=(0.0, slope, 0.0)),
        interior=None, size=frozen(box.size), centre=frozen((0.0, 0.0, 0.0)),
    )  # fmt: skip


def run(engine: Engine, ticks: int, force: float = 0.0) -> None:
    command = JointCommand(1)
    command.obey(["effort"])
    command.effort[:] = force
    for _ in range(ticks):
        engine.write(command)
        engine.advance()
    engine.read()


def lying(
    opens: Opens, member: EngineMember, block: str, support: str, *, block_first: bool, slope: float, mu: float
) -> tuple[Contact, float, Engine]:
    """The contact after 0.4 s of a block on a plane that falls towards +x by `slope` [rad] and passes through
    (5, 0, 0); and the sign of forces on the block, if they are stated for `a`."""
    normal = np.array((math.sin(slope), 0.0, math.cos(slope)))
    origin = np.array((5.0, 0.0, 0.0))
    bodies = [
        body(block, HALF, origin + HALF[2] * normal, slope=slope, fixed=False, friction=math.sqrt(mu)),
        body(support, (3.0, 1.0, 0.1), origin - 0.1 * normal, slope=slope, fixed=True, friction=math.sqrt(mu)),
    ]
    engine = opens(member, *(bodies if block_first else reversed(bodies)))
    run(engine, 400)
    (contact,) = engine.contacts()
    assert (contact.a, contact.b) == tuple(sorted((block, support)))
    return contact, 1.0 if contact.a == block else -1.0, engine


def total(contact: Contact) -> Array:
    """(3,) [N] force on `a`."""
    found: Array = np.sum([p.force * np.array(p.normal) + p.friction for p in contact.points], axis=0)
    return found


@with_physics
@in_any_order
@first_or_last
def test_a_block_at_rest_is_carried_at_its_lower_face(
    member: EngineMember, opens: Opens, block: str, support: str, block_first: bool
) -> None:
    """Sum of forces = m g, sum of torques = 0: the centre of pressure is below the centre of mass."""
    contact, side, _ = lying(opens, member, block, support, block_first=block_first, slope=0.0, mu=0.5)
    forces = np.array([p.force for p in contact.points])
    positions = np.array([p.position for p in contact.points])
    normals = np.array([p.normal for p in contact.points])
    assert len(forces) >= 3
    np.testing.assert_allclose(side * normals, np.broadcast_to([0.0, 0.0, 1.0], normals.shape), atol=1e-6)
    assert forces.sum() == pytest.approx(contact.force, rel=1e-12)
    np.testing.assert_allclose(side * total(contact), [0.0, 0.0, WEIGHT], atol=0.01 * WEIGHT)
    assert abs(positions[:, 2]).max() < 1e-3
    assert (abs(positions[:, :2] - [5.0, 0.0]) <= np.array(HALF[:2]) + 1e-3).all()
    np.testing.assert_allclose(forces @ positions[:, :2] / forces.sum(), [5.0, 0.0], atol=2e-3)


@with_physics
@in_any_order
@first_or_last
def test_friction_carries_the_weight_along_a_slope(
    member: EngineMember, opens: Opens, block: str, support: str, block_first: bool
) -> None:
    """At rest N = m g cos s and F = m g sin s, uphill on the block."""
    s = math.radians(20.0)
    contact, side, _ = lying(opens, member, block, support, block_first=block_first, slope=s, mu=0.6)
    friction = side * np.sum([p.friction for p in contact.points], axis=0)
    uphill, up = np.array((-math.cos(s), 0.0, math.sin(s))), np.array((math.sin(s), 0.0, math.cos(s)))
    np.testing.assert_allclose(friction, WEIGHT * math.sin(s) * uphill, atol=0.01 * WEIGHT)
    assert contact.force == pytest.approx(WEIGHT * math.cos(s), rel=0.01)
    for point in contact.points:
        np.testing.assert_allclose(side * np.array(point.normal), up, atol=1e-3)
        assert abs(np.dot(point.friction, point.normal)) < 1e-3 * WEIGHT


@with_physics
@in_any_order
def test_friction_of_a_sliding_block_is_the_coefficient_times_the_normal_force(
    member: EngineMember, opens: Opens, block: str, support: str
) -> None:
    """Beyond the angle of friction, F = mu N against the motion."""
    s, mu = math.radians(35.0), 0.4
    contact, side, engine = lying(opens, member, block, support, block_first=True, slope=s, mu=mu)
    friction = side * np.sum([p.friction for p in contact.points], axis=0)
    assert np.linalg.norm(friction) == pytest.approx(mu * contact.force, rel=0.05)
    velocity = engine.read().body_linear[0]
    assert friction @ velocity / np.linalg.norm(friction) / np.linalg.norm(velocity) < -0.99


@with_physics
@pytest.mark.parametrize("wall", ["a_wall", "wall"])
def test_a_pad_presses_where_it_meets_the_wall(member: EngineMember, opens: Opens, wall: str) -> None:
    """A pad that slides along x with 5 N meets a wall at x = 0.2: the wall's force on it is -5 N along x."""
    engine = opens(member, body(wall, (0.05, 0.5, 0.5), np.array((0.25, 0.0, 1.0)), fixed=True, friction=0.5))
    run(engine, 800, force=5.0)
    (contact,) = engine.contacts()
    assert (contact.a, contact.b) == tuple(sorted((wall, "robot/pad")))
    side = 1.0 if contact.a == "robot/pad" else -1.0
    assert side * total(contact)[0] == pytest.approx(-5.0, rel=0.02)
    for point in contact.points:
        np.testing.assert_allclose(side * np.array(point.normal), [-1.0, 0.0, 0.0], atol=1e-3)
        np.testing.assert_allclose(point.position[0], 0.2, atol=1e-3)
        assert abs(np.array(point.position[1:]) - [0.0, 1.0]).max() <= 0.05 + 1e-3
