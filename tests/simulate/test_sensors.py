"""Sensors against closed forms of statics and kinematics, in every engine with physics."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from manipcli.control.command import JointCommand, Mode
from manipcli.core.geometry import Array, Transform, frozen, matrix_from_rpy
from manipcli.description.elements import Inertial, Joint, JointLimits, JointType, Link
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry
from manipcli.simulate.engine import Engine, EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.sensor_bank import SensorBank
from manipcli.simulate.sensors.contact import ContactSpec
from manipcli.simulate.sensors.force_torque import ForceTorqueSpec
from manipcli.simulate.sensors.imu import ImuSpec
from manipcli.simulate.sensors.joint import JointSpec
from manipcli.simulate.sensors.tactile import TactileSpec
from manipcli.spec.robot import PoseSpec
from manipcli.spec.sensors import SensorSpec

STEP = 1e-3
G = 9.81
MASS, COM = 0.8, np.array([0.05, -0.04, 0.02])
with_physics = pytest.mark.parametrize(
    "member", [member for member in ENGINES if member.physics == "full"], ids=lambda member: member.name
)
AT = PoseSpec(xyz=(0.3, 0.02, -0.05), rpy=(0.4, -0.7, 1.1))
R_LS, P_LS = matrix_from_rpy((0.4, -0.7, 1.1)), np.array([0.3, 0.02, -0.05])


def robot(kind: JointType, axis: tuple[float, float, float]) -> RobotModel:
    """A driven link with an off-centre mass, 2 m above the floor."""
    limits = JointLimits(-50.0, 50.0, 50.0, 500.0)
    joint = Joint("drive", kind, "base", "arm", Transform.of(xyz=(0.0, 0.0, 2.0)), frozen(axis), limits)
    plate = Geometry(Transform.identity(), Box((0.2, 0.2, 0.02)))
    inertial = Inertial(MASS, Transform.of(xyz=COM), frozen(np.diag([0.01, 0.012, 0.015])))
    links = (Link("base", None, (), ()), Link("arm", inertial, (plate,), (plate,)))
    return RobotModel("testbot", "base", links, (joint,), (), (), (), Transform.identity(), "")


def block(at: tuple[float, float, float]) -> Body:
    """A cube of 10 cm and 1 kg."""
    return Body(
        name="block", kind="box", geometries=(Geometry(Transform.identity(), Box((0.1, 0.1, 0.1))),), mass=1.0,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3) * 0.01 / 6.0), friction=0.8, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=False, X_WO=Transform.of(xyz=at), interior=None,
        size=frozen([0.1] * 3), centre=frozen(np.zeros(3)),
    )  # fmt: skip


class Bench:
    """An engine and its sensors, ticked together."""

    def __init__(self, engine: Engine, bank: SensorBank) -> None:
        self.engine, self.bank, self.ticks = engine, bank, 0
        self.command = JointCommand(1)

    def run(self, ticks: int, mode: Mode, value: float = 0.0) -> None:
        """Hold a position, a velocity or an effort."""
        self.command.obey((mode,))
        target = {"position": self.command.position, "velocity": self.command.velocity, "effort": self.command.effort}
        if mode in target:
            target[mode][:] = value
        for _ in range(ticks):
            state = self.engine.read()
            self.bank.sense(self.ticks, state)
            self.engine.write(self.command)
            self.engine.advance()
            self.ticks += 1

    def __getitem__(self, name: str) -> Array:
        return self.bank.reading(name)


@contextmanager
def bench(
    member: EngineMember, model: RobotModel, sensors: Mapping[str, SensorSpec], *bodies: Body, q: float = 0.0,
    velocity: float = 0.0, twist: tuple[float, ...] = (0.0,) * 6,
) -> Iterator[Bench]:  # fmt: skip
    scene = Scene(bodies, (), frozen([0.0, 0.0, -G]))
    free = [body for body in bodies if not body.fixed]
    twists = frozen([twist] * len(free)) if free else None
    engine = member.open(model, scene, EngineSettings(STEP, 1, frozen([q]), velocity=frozen([velocity]), twists=twists))
    try:
        bank = SensorBank(sensors, model, scene, engine, period=STEP, seed=0, state=engine.read())
        yield Bench(engine, bank)
    finally:
        engine.close()


@with_physics
def test_at_rest_the_wrench_is_the_weight_in_the_sensor_frame(member: EngineMember) -> None:
    q, axis = 0.6, (1.0, 0.0, 0.0)
    sensors = {"wrist": ForceTorqueSpec(type="force_torque", link="arm", at=AT)}
    with bench(member, robot("revolute", axis), sensors, q=q) as world:
        world.run(800, "position", q)
        R_WS = matrix_from_rpy((q, 0.0, 0.0)) @ R_LS
        weight = R_WS.T @ np.array([0.0, 0.0, -G * MASS])
        np.testing.assert_allclose(world["wrist"][:3], weight, atol=2e-3)
        np.testing.assert_allclose(world["wrist"][3:], np.cross(R_LS.T @ (COM - P_LS), weight), atol=2e-3)


@with_physics
def test_at_rest_an_imu_measures_gravity_upwards(member: EngineMember) -> None:
    q = 0.6
    sensors: dict[str, SensorSpec] = {
        "arm_imu": ImuSpec(type="imu", link="arm", at=AT),
        "still": ImuSpec(type="imu", at=AT),
        "on_block": ImuSpec(type="imu", frame="block", at=AT),
    }
    floor = replace(block((1.0, 0.0, -0.05)), name="floor", fixed=True)
    with bench(member, robot("revolute", (1.0, 0.0, 0.0)), sensors, block((1.0, 0.0, 0.05)), floor, q=q) as world:
        world.run(800, "position", q)
        up = np.array([0.0, 0.0, G])
        R_WS = matrix_from_rpy((q, 0.0, 0.0)) @ R_LS
        np.testing.assert_allclose(world["arm_imu"], [0.0, 0.0, 0.0, *(R_WS.T @ up)], atol=5e-3)
        np.testing.assert_allclose(world["still"], [0.0, 0.0, 0.0, *(R_LS.T @ up)], atol=1e-12)
        np.testing.assert_allclose(world["on_block"], [0.0, 0.0, 0.0, *(R_LS.T @ up)], atol=5e-3)


@with_physics
def test_in_free_fall_an_imu_measures_nothing(member: EngineMember) -> None:
    sensors = {"arm_imu": ImuSpec(type="imu", link="arm", at=AT), "on_block": ImuSpec(type="imu", frame="block", at=AT)}
    with bench(member, robot("prismatic", (0.0, 0.0, 1.0)), sensors, block((1.0, 0.0, 1.5))) as world:
        world.run(100, "effort", 0.0)
        speed = float(world.engine.read().velocity[0])
        assert speed == pytest.approx(-0.1 * G, rel=0.01)
        # Bullet damps velocities of free bodies by 0.04 1/s.
        np.testing.assert_allclose(world["arm_imu"], 0.0, atol=0.05)
        np.testing.assert_allclose(world["on_block"], 0.0, atol=0.05)


@with_physics
@pytest.mark.parametrize("rate", [-4.0, 2.0])
def test_on_a_turning_joint_an_imu_measures_the_centripetal_acceleration(member: EngineMember, rate: float) -> None:
    """a = -w^2 r towards the axis, and gravity, in closed form."""
    sensors = {"imu": ImuSpec(type="imu", link="arm", at=AT)}
    with bench(member, robot("continuous", (0.0, 0.0, 1.0)), sensors, velocity=rate) as world:
        world.run(300, "velocity", rate)
        up = np.array([0.0, 0.0, G])
        towards_axis = -(rate**2) * np.array([P_LS[0], P_LS[1], 0.0])
        np.testing.assert_allclose(world["imu"][:3], R_LS.T @ np.array([0.0, 0.0, rate]), atol=1e-3)
        np.testing.assert_allclose(world["imu"][3:], R_LS.T @ (towards_axis + up), atol=5e-3)


@with_physics
def test_on_a_spinning_body_an_imu_measures_the_centripetal_acceleration(member: EngineMember) -> None:
    """A cube that falls and spins about z: only the centripetal term is left, and it turns with the cube."""
    sensors = {"imu": ImuSpec(type="imu", frame="block", at=PoseSpec(xyz=(0.04, 0.0, 0.0)))}
    twist = (0.0, 0.0, 0.0, 0.0, 0.0, 10.0)
    with bench(member, robot("revolute", (1.0, 0.0, 0.0)), sensors, block((1.0, 0.0, 1.5)), twist=twist) as world:
        world.run(50, "brake")
        rate = float(world.engine.read().body_angular[0, 2])
        assert rate == pytest.approx(10.0, rel=0.01)
        np.testing.assert_allclose(world["imu"], [0.0, 0.0, rate, -(rate**2) * 0.04, 0.0, 0.0], atol=0.05)


@with_physics
def test_touch_adds_up_to_the_weight_that_lies_on_a_link(member: EngineMember) -> None:
    """A cube of 1 kg on the arm: the switch closes, the cells add up to its weight, around the place where it lies."""
    at = PoseSpec(xyz=(0.0, 0.0, 0.01))
    sensors: dict[str, SensorSpec] = {
        "switch": ContactSpec(type="contact", link="arm", threshold=5.0),
        "late": ContactSpec(type="contact", link="arm", threshold=5.0, rate=100.0, delay=0.02),
        "pad": TactileSpec(type="tactile", link="arm", at=at, size=(0.2, 0.2), rows=4, columns=4),
        "below": TactileSpec(
            type="tactile", link="arm", at=PoseSpec(xyz=(0.0, 0.0, -0.01), rpy=(np.pi, 0.0, 0.0)), size=(0.2, 0.2),
            rows=2, columns=2,
        ),
        "cube": ContactSpec(type="contact", frame="block", threshold=5.0),
    }  # fmt: skip
    with bench(member, robot("prismatic", (0.0, 0.0, 1.0)), sensors, block((0.04, 0.0, 2.0601))) as world:
        world.run(1000, "position", 0.0)
        pressing = world["switch"][0]
        assert pressing == pytest.approx(G, rel=0.01)
        assert world["late"][0] == pytest.approx(G, rel=0.01)
        assert world["cube"][0] == pressing
        cells = world["pad"].reshape(4, 4)  # rows along y, columns along x
        assert cells.sum() == pytest.approx(pressing, rel=1e-6)
        middles = (np.arange(4) - 1.5) * 0.05
        assert (cells.sum(axis=0) @ middles) / pressing == pytest.approx(0.04, abs=0.01)
        assert (cells.sum(axis=1) @ middles) / pressing == pytest.approx(0.0, abs=0.005)
        assert not world["below"].any()


@with_physics
def test_joints_are_what_the_engine_reads(member: EngineMember) -> None:
    with bench(member, robot("revolute", (1.0, 0.0, 0.0)), {"encoder": JointSpec(type="joint", delay=0.003)}) as world:
        world.run(50, "velocity", 0.5)
        before = world.engine.read().position[0]
        world.run(1, "velocity", 0.5)
        world.run(3, "velocity", 0.5)
        assert world["encoder"][0] == before
        assert world.bank.joints is not None
        assert world.bank.joints.position[0] == before


@with_physics
def test_another_sensor_changes_no_reading(member: EngineMember) -> None:
    noise = {"angular_velocity": {"white": 0.1, "bias": 0.1, "walk": 0.1}, "dropout": 0.1}
    imu = ImuSpec.model_validate({"type": "imu", "link": "arm", "noise": noise, "delay": 0.004})
    others: dict[str, SensorSpec] = {
        "pad": ContactSpec(type="contact", link="arm", threshold=1.0),
        "wrist": ForceTorqueSpec(type="force_torque", link="arm"),
    }
    found = []
    for sensors in ({"imu": imu}, {**others, "imu": imu}, {"imu": imu, **others}):
        with bench(member, robot("revolute", (1.0, 0.0, 0.0)), sensors, block((1.0, 0.0, 0.05))) as world:
            seen = []
            for _ in range(300):
                world.run(1, "velocity", 0.5)
                seen.append(world["imu"].copy())
            found.append(np.array(seen))
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])
