"""A gripper lifts a block under a heavier plate on two posts: the reflex holds it, in every engine with physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from manipcli.control.action import GripperGoal
from manipcli.control.controller import ControllerOutput
from manipcli.control.controllers.forward_command import ForwardCommandController
from manipcli.control.grip_reflex import RATE
from manipcli.control.gripper_controller import GripperController
from manipcli.control.manager import ControllerManager
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.plan.motion import Reflex
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry
from manipcli.simulate.engine import EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.sensors.tactile import TactileSpec
from manipcli.simulate.session import Session
from manipcli.spec.controllers import GainsSpec
from manipcli.spec.robot import PoseSpec
from manipcli.spec.sensors import SensorSpec

PERIOD, G = 1e-3, 9.81
BLOCK, PLATE, MU, FORCE = 0.3, 0.6, 0.6, 4.0
LIFT = 0.015
with_physics = pytest.mark.parametrize(
    "member", [member for member in ENGINES if member.physics == "full"], ids=lambda member: member.name
)


def robot() -> RobotModel:
    """Two plates that slide along x towards each other, on a carriage that slides along z."""
    pad = Geometry(Transform.identity(), Box((0.01, 0.03, 0.01)))
    inertial = Inertial(0.2, Transform.identity(), frozen(np.eye(3) * 1e-4))
    links = [Link("base", None, (), ()), Link("carriage", inertial, (), ())]
    limits = JointLimits(-0.1, 0.1, 1.0, 30.0)
    joints = [
        Joint("lift", "prismatic", "base", "carriage", Transform.of(xyz=(0, 0, 0.52)), frozen((0, 0, 1.0)), limits)
    ]
    for name, side in (("left", 1.0), ("right", -1.0)):
        links.append(Link(name, inertial, (pad,), (pad,)))
        at = Transform.of(xyz=(-side * 0.027, 0.0, 0.0))
        joints.append(Joint(name, "prismatic", "carriage", name, at, frozen((side, 0.0, 0.0)), limits))
    return RobotModel("vice", "base", tuple(links), tuple(joints), (), (), (), Transform.identity(), "")


def box(name: str, size: tuple[float, float, float], at: tuple[float, float, float], mass: float = 0.0) -> Body:
    """Fixed without a mass."""
    sides = np.square(size)
    inertia = (mass or 1.0) / 12.0 * (sides.sum() - sides)
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), Box(size)),), mass=mass or 1.0,
        X_OI=Transform.identity(), inertia=frozen(np.diag(inertia)), friction=MU, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=not mass, X_WO=Transform.of(xyz=at), interior=None,
        size=frozen(size), centre=frozen(np.zeros(3)),
    )  # fmt: skip


SCENE = Scene(
    (
        box("block", (0.04, 0.04, 0.04), (0.0, 0.0, 0.52), BLOCK),
        box("pedestal", (0.04, 0.04, 0.5), (0.0, 0.0, 0.25)),
        box("plate", (0.03, 0.3, 0.02), (0.0, 0.0, 0.555), PLATE),
        box("post_1", (0.03, 0.04, 0.545), (0.0, 0.13, 0.2725)),
        box("post_2", (0.03, 0.04, 0.545), (0.0, -0.13, 0.2725)),
    ),
    (),
    frozen([0.0, 0.0, -G]),
)  # fmt: skip


class Pressed:
    """Keeps the normal forces of the fingers."""

    def __init__(self) -> None:
        self.forces: list[float] = []

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None: ...

    def contacts(self, tick: int, contacts: tuple[Contact, ...]) -> None:
        self.forces += [each.force for each in contacts if each.b in ("robot/left", "robot/right")]


@dataclass(frozen=True)
class End:
    """Where all is after the lift, and how the hand pressed."""

    block: float
    plate: float
    forces: Array
    reflex: str


@cache
def lifted(member: EngineMember, reflex: Reflex | None) -> End:
    """Close with 4 N, lift by 15 mm in 0.5 s, and wait."""
    model = robot()
    noise = {"force": {"white": 0.02}, "shear": {"white": 0.02}}
    sensors: dict[str, SensorSpec] = {}
    for link, side in (("left", 1.0), ("right", -1.0)):
        at = PoseSpec(xyz=(side * 0.005, 0.0, 0.0), rpy=(0.0, side * np.pi / 2.0, 0.0))
        sensors[f"{link}_pad"] = TactileSpec.model_validate({
            "type": "tactile", "link": link, "at": at, "size": (0.011, 0.031), "rows": 2, "columns": 2, "shear": True,
            "rate": 200.0, "delay": 0.005, "noise": noise,
        })  # fmt: skip
    gains = {name: GainsSpec(p=2000.0, d=20.0) for name in ("left", "right")}
    hand = GripperController(
        name="hand", joints=("left", "right"), types=["prismatic"] * 2, gains=gains, speed=0.02, max_effort=30.0
    )
    lift = ForwardCommandController(name="lift", joints=("lift",), interface="position")
    manager = ControllerManager(joints=model.joint_names, period=PERIOD)
    for controller in (hand, lift):
        manager.load(controller)
        manager.configure(controller.name)
    assert manager.switch(["hand", "lift"]).ok
    engine = member.open(model, SCENE, EngineSettings(PERIOD, 1, frozen(np.zeros(3))))
    try:
        session = Session(
            robot=model, scene=SCENE, engine=engine, manager=manager, period=PERIOD, sensors=sensors, seed=1
        )
        seen = session.observer = Pressed()
        goal = hand.send_goal(GripperGoal(target=np.full(2, 0.01), force=FORCE, reflex=reflex))
        while goal.active:
            session.tick()
        for k in range(800):
            lift.set_command([0.5 * (1.0 - np.cos(np.pi * min(1.0, k / 600))) * LIFT])
            session.tick()
        block, _, plate, _, _ = (body.name for body in SCENE.bodies)
        z = {body.name: float(at[2]) for body, at in zip(SCENE.movable, session.state.body_position, strict=True)}
        return End(z[block] - 0.52, z[plate] - 0.555, np.array(seen.forces), hand.reflex.report())
    finally:
        engine.close()


@with_physics
def test_the_reflex_holds_what_slips_without_it(member: EngineMember) -> None:
    held, slipped = lifted(member, Reflex(MU, 0.8)), lifted(member, None)
    assert held.block > LIFT - 4e-3  # it slides until the force is there, while the hand moves at 4 cm/s
    assert held.plate > 5e-3
    assert held.reflex.startswith("reflex: ")
    # Without it the fingers carry 2 mu F, less than both weigh: the block stays where it touches the plate.
    assert slipped.reflex == ""
    assert slipped.plate < 1e-4
    assert slipped.block < LIFT - 9e-3


@with_physics
def test_the_fingers_press_with_the_force_that_the_load_needs(member: EngineMember) -> None:
    """F = (m + M) g / (2 mu onset) in the contacts of the engine, and at most RATE times the delays more."""
    wanted = (BLOCK + PLATE) * G / (2.0 * MU * 0.8)
    found = np.median(lifted(member, Reflex(MU, 0.8)).forces[-200:])
    assert wanted * 0.99 < found < wanted + RATE * 0.02


@with_physics
def test_the_fingers_never_press_with_more_than_the_limit(member: EngineMember) -> None:
    """6 N do not hold both; 3 % for the contact solver."""
    end = lifted(member, Reflex(MU, 0.8, 6.0))
    assert end.reflex.endswith(", its limit")
    assert np.median(end.forces[-200:]) == pytest.approx(6.0, rel=0.03)
    assert np.percentile(end.forces, 99) < 6.0 * 1.03
    assert end.block < LIFT - 3e-3
