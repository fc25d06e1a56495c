"""A slide and a two-joint finger, an engine whose world the test writes, and sessions of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
import pytest

from manipcli.control.command import JointCommand
from manipcli.control.controllers.gripper import GripperController
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.manager import ControllerManager
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines.kinematic import KinematicEngine
from manipcli.simulate.session import Session
from manipcli.spec.controllers import ConstraintsSpec, GainsSpec, JointConstraintSpec

PERIOD = 1e-3
JOINTS = ("slide", "knuckle", "tip")


def _joint(name: str, parent: str, child: str, kind: Any, velocity: float | None) -> Joint:
    limits = JointLimits(-2.0, 2.0, velocity, 100.0, 50.0)
    return Joint(name, kind, parent, child, Transform.identity(), frozen([0.0, 0.0, 1.0]), limits)


ROBOT = RobotModel(
    name="testbot",
    root="base",
    links=tuple(Link(name, None, (), ()) for name in ("base", "carriage", "near", "far", "pad")),
    joints=(
        _joint("slide", "base", "carriage", "prismatic", 2.0),
        _joint("knuckle", "carriage", "near", "revolute", 3.0),
        _joint("tip", "near", "far", "revolute", None),
        _joint("glue", "far", "pad", "fixed", None),
    ),
    groups=(),
    poses=(),
    transmissions=(),
    X_WB=Transform.identity(),
    urdf="",
)
BLOCK = Body(
    name="block", kind="box", geometries=(Geometry(Transform.identity(), Box((0.1, 0.1, 0.1))),), mass=1.0,
    X_OI=Transform.identity(), inertia=frozen(np.eye(3)), friction=1.0, rolling_friction=0.0, spinning_friction=0.0,
    restitution=0.0, fixed=False, X_WO=Transform.of(xyz=(1.0, 0.0, 0.5)), interior=None, size=frozen([0.1] * 3),
    centre=frozen([0.0] * 3),
)  # fmt: skip
SCENE = Scene((BLOCK,), (), frozen([0.0, 0.0, -9.81]))


@dataclass
class ScriptedEngine:
    """Stands still; `script` may change the state and the contacts before each read, and sees what was written."""

    script: Callable[[ScriptedEngine], None] | None = None
    ideal: bool = False
    tick: int = 0
    touching: tuple[Contact, ...] = ()
    seen: tuple[Contact, ...] = ()
    written: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.state = WorldState(
            time=np.zeros(()), position=np.zeros(3), velocity=np.zeros(3), effort=np.zeros(3),
            body_position=np.array([BLOCK.X_WO.p]), body_quat_xyzw=np.array([[0.0, 0.0, 0.0, 1.0]]),
            body_linear=np.zeros((1, 3)), body_angular=np.zeros((1, 3)),
        )  # fmt: skip

    def read(self, *, velocities: bool = True) -> WorldState:
        if self.script is not None:
            self.script(self)
        return self.state

    def write(self, command: JointCommand) -> None:
        self.written.append(command.effort.copy())

    def advance(self) -> None:
        self.tick += 1

    def touches_changed(self) -> bool:
        seen, self.seen = self.seen, self.touching
        return seen != self.seen

    def contacts(self, *, peek: bool = False) -> tuple[Contact, ...]:
        return self.touching

    def close(self) -> None: ...


def make_manager() -> ControllerManager:
    """`arm` follows trajectories of the slide, to 0.1 m on the way and 0.01 m at the end; `hand` is one finger."""
    constraints = ConstraintsSpec(goal_time=0.2, joints={"slide": JointConstraintSpec(trajectory=0.1, goal=0.01)})
    slide = ROBOT.joint("slide")
    arm = JointTrajectoryController(
        name="arm", joints=("slide",), gains={"slide": GainsSpec(p=100.0)}, constraints=constraints,
        limits=[slide.limits], types=[slide.type],
    )  # fmt: skip
    hand = GripperController(
        name="hand", joints=("knuckle", "tip"), gains={n: GainsSpec(p=1.0) for n in ("knuckle", "tip")},
        fingers=((0, 1),), speed=2.0, stall_time=0.1,
    )  # fmt: skip
    return ControllerManager([arm, hand], joints=JOINTS, period=PERIOD)


def make_session(engine: object = None) -> Session:
    """A session of the ideal engine, or of another one."""
    manager = make_manager()
    settings = EngineSettings(PERIOD, 1, np.zeros(3))
    return Session(
        robot=ROBOT,
        scene=SCENE,
        engine=cast(Any, engine or KinematicEngine(ROBOT, SCENE, settings)),
        manager=manager,
        period=PERIOD,
    )


@pytest.fixture
def session_of() -> Callable[..., Session]:
    return make_session


@pytest.fixture
def scripted() -> type[ScriptedEngine]:
    return ScriptedEngine
