"""Taxels with shear against the engine's contacts and Coulomb's law in closed form, in every engine with physics."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from pydantic import ValidationError

from manipcli.control.command import JointCommand
from manipcli.core.geometry import Array, Transform, frozen, matrix_from_rpy
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.friction_share import friction_share, grip_forces, joint_forces
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry
from manipcli.simulate.engine import Engine, EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.sensor_bank import SensorBank
from manipcli.simulate.sensors.tactile import MEMBER, TactileNoise, TactileSpec
from manipcli.spec.robot import PoseSpec
from manipcli.spec.sensors import ForceNoise, SensorSpec

STEP, G = 1e-3, 9.81
MASS, MU = 0.5, 0.6
HALF = 0.02
with_physics = pytest.mark.parametrize(
    "member", [member for member in ENGINES if member.physics == "full"], ids=lambda member: member.name
)


def fingers() -> RobotModel:
    """Two plates that slide along x towards each other, at a height of 1 m."""
    plate = Geometry(Transform.identity(), Box((0.01, 0.04, 0.04)))
    inertial = Inertial(0.2, Transform.identity(), frozen(np.eye(3) * 1e-4))
    links, joints = [Link("base", None, (), ())], []
    for name, side in (("left", 1.0), ("right", -1.0)):
        links.append(Link(name, inertial, (plate,), (plate,)))
        at = Transform.of(xyz=(-side * (HALF + 0.005), 0.0, 1.0))
        limits = JointLimits(-0.1, 0.1, 1.0, 100.0)
        joints.append(Joint(name, "prismatic", "base", name, at, frozen((side, 0.0, 0.0)), limits))
    return RobotModel("vice", "base", tuple(links), tuple(joints), (), (), (), Transform.identity(), "")


def pad(link: str, side: float, **keys: object) -> TactileSpec:
    """On the face of a plate: z out of it (along side x), x up."""
    at = PoseSpec(xyz=(side * 0.005, 0.0, 0.0), rpy=(0.0, side * np.pi / 2.0, 0.0))
    given = {"type": "tactile", "link": link, "at": at, "size": (0.041, 0.041), "rows": 3, "columns": 3, "shear": True}
    return TactileSpec.model_validate({**given, **keys})


class Vice:
    """A block between the two plates, which press with equal forces."""

    def __init__(self, engine: Engine, bank: SensorBank) -> None:
        self.engine, self.bank, self.ticks = engine, bank, 0
        self.command = JointCommand(2)
        self.command.obey(("effort", "effort"))

    def press(self, ticks: int, force: float) -> None:
        for _ in range(ticks):
            self.bank.sense(self.ticks, self.engine.read())
            self.command.effort[:] = force
            self.engine.write(self.command)
            self.engine.advance()
            self.ticks += 1
        self.bank.sense(self.ticks, self.engine.read())

    @property
    def height(self) -> float:
        return float(self.engine.read().body_position[0, 2])

    def on(self, link: str) -> Array:
        """(3) [N] The force on a link, of the engine's contact report."""
        total = np.zeros(3)
        for contact in self.engine.contacts(peek=True):
            sign = {f"robot/{link}": 1.0}.get(contact.a, -1.0 if contact.b == f"robot/{link}" else 0.0)
            for point in contact.points:
                total += sign * (point.force * np.array(point.normal) + np.array(point.friction))
        return total

    @property
    def share(self) -> float:
        """Of the friction cone, of both pads together."""
        readings = [self.bank.reading(name) for name in ("left_pad", "right_pad")]
        rotations = [matrix_from_rpy((0.0, side * np.pi / 2.0, 0.0)) for side in (1.0, -1.0)]
        return float(friction_share(*joint_forces(readings, rotations), MU))

    def sums(self, name: str) -> Array:
        """(3) [N] Sums of the normal forces, and of the shear along x and y of the sensor frame."""
        found: Array = self.bank.reading(name).reshape(3, -1).sum(axis=1)
        return found


@contextmanager
def vice(member: EngineMember, force: float) -> Iterator[Vice]:
    block = Body(
        name="block", kind="box", geometries=(Geometry(Transform.identity(), Box((2.0 * HALF,) * 3)),), mass=MASS,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3) * MASS * (2.0 * HALF) ** 2 / 6.0), friction=MU,
        rolling_friction=0.0, spinning_friction=0.0, restitution=0.0, fixed=False,
        X_WO=Transform.of(xyz=(0.0, 0.0, 1.0)), interior=None, size=frozen([2.0 * HALF] * 3),
        centre=frozen(np.zeros(3)),
    )  # fmt: skip
    scene = Scene((block,), (), frozen([0.0, 0.0, -G]))
    model = fingers()
    sensors: dict[str, SensorSpec] = {"left_pad": pad("left", 1.0), "right_pad": pad("right", -1.0)}
    engine = member.open(model, scene, EngineSettings(STEP, 1, frozen([0.0, 0.0])))
    try:
        world = Vice(engine, SensorBank(sensors, model, scene, engine, period=STEP, seed=0, state=engine.read()))
        world.press(300, force)
        yield world
    finally:
        engine.close()


@with_physics
def test_shear_adds_up_to_the_contact_forces_and_to_the_weight(member: EngineMember) -> None:
    """Each sensor frame has x along -side z of the world and y along y."""
    with vice(member, 20.0) as world:
        weight = 0.0
        for name, link, side in (("left_pad", "left", 1.0), ("right_pad", "right", -1.0)):
            on_it = world.on(link)
            found = world.sums(name)
            np.testing.assert_allclose(found[1:], [-side * on_it[2], on_it[1]], atol=1e-9)
            assert found[0] == pytest.approx(-side * on_it[0], rel=1e-4)  # friction along z
            weight += side * world.sums(name)[1]
        assert weight == pytest.approx(MASS * G, rel=0.01)  # the solver's residual


@with_physics
def test_the_share_is_1_where_the_block_slips(member: EngineMember) -> None:
    """F falls slowly: the share of the cone is m g / (2 mu F), and 1 once m g > 2 mu F, when the block slides.

    The last tolerance is Bullet's: it shares friction between two directions, and the block creeps from 0.9 on.
    """
    limit = MASS * G / (2.0 * MU)
    with vice(member, 3.0 * limit) as world:
        start = world.height
        for part in (2.0, 1.5, 1.25):
            world.press(60, part * limit)
            assert world.share == pytest.approx(1.0 / part, rel=0.03)
        assert abs(start - world.height) < 1e-4
        for part in (1.0, 0.97, 0.95):
            world.press(60, part * limit)
        assert world.share == pytest.approx(1.0, rel=0.05)
        assert start - world.height > 5e-4


def test_the_share_has_values_at_the_ends_of_its_domain() -> None:
    normal, tangential = np.array([0.0, 0.0, 10.0, -0.1, 4.0]), np.array([0.0, 1.0, 0.0, 0.2, 1.0])
    np.testing.assert_array_equal(friction_share(normal, tangential, 0.5), [0.0, np.inf, 0.0, np.inf, 0.5])
    readings = np.arange(12.0).reshape(2, 6)
    np.testing.assert_allclose(grip_forces(readings), [[1.0, 13.0], [np.hypot(5.0, 9.0), np.hypot(17.0, 21.0)]])


def test_shear_has_its_own_noise_and_limits() -> None:
    given = pad("left", 1.0, noise={"shear": {"white": 0.1}}, limits={"shear": 2.0})
    force, shear = MEMBER.quantities(given, fingers())
    assert (force.noise, force.width, force.least) == (ForceNoise(), 9, 0.0)
    assert (shear.noise.white, shear.width, shear.least, shear.most) == (0.1, 18, -2.0, 2.0)
    with pytest.raises(ValidationError, match="measure the normal force alone"):
        pad("left", 1.0, shear=None, noise=TactileNoise(shear=ForceNoise()))


def test_topics_divide_the_reading() -> None:
    reading = np.arange(27.0)[None]
    for topic, wanted in zip(MEMBER.topics(pad("left", 1.0), fingers()), (reading[:, :9], reading[:, 9:]), strict=True):
        assert topic.derive is not None
        np.testing.assert_array_equal(topic.derive(reading), wanted)
