"""Small worlds as code: bodies, a robot that is out of the way, a vice, a pendulum; and an open engine to step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

import numpy as np

from manipcli.control.command import JointCommand, Mode
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, JointType, Link
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry, Shape, Sphere
from manipcli.simulate.engine import Engine, EngineSettings
from manipcli.simulate.engines import ENGINES

STEP: Final = 1e-3
"""[s]"""
G: Final = 9.81
"""[m/s2]"""
NAMES: Final = {"pybullet": "PyBullet", "mujoco": "MuJoCo"}
"""The engines that are compared, and how the page calls them."""


def body(
    name: str,
    shape: Shape,
    at: Sequence[float],
    *,
    mass: float = 0.0,
    friction: float = 1.0,
    pitch: float = 0.0,
) -> Body:
    """A box or a sphere of even density, fixed without a mass [kg]; `pitch`: angle about y [rad]."""
    if isinstance(shape, Box):
        x, y, z = (length**2 for length in shape.size)
        moments = [mass / 12.0 * each for each in (y + z, x + z, x + y)]
    else:
        assert isinstance(shape, Sphere)
        moments = [0.4 * mass * shape.radius**2] * 3
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), shape),), mass=mass,
        X_OI=Transform.identity(), inertia=frozen(np.diag(moments)), friction=friction, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=mass == 0.0,
        X_WO=Transform.of(xyz=at, rpy=(0.0, pitch, 0.0)), interior=None, size=frozen([0.1] * 3),
        centre=frozen(np.zeros(3)),
    )  # fmt: skip


def robot(
    links: Sequence[tuple[float, Sequence[float], Shape | None]],
    kind: JointType,
    axis: Sequence[float],
    places: Sequence[Sequence[float]],
    *,
    base: Shape | None = None,
) -> RobotModel:
    """A chain of joints of one kind.

    Args:
        links: mass [kg], centre of mass [m] and collision shape of each moving link.
        kind, axis: of the joints.
        places: (3) [m] each joint in the link before it.
        base: collision shape of the base.
    """
    limits = JointLimits(None, None, 5.0, 1000.0) if kind == "continuous" else JointLimits(-4.0, 4.0, 5.0, 1000.0)
    made, joints = [Link("base", None, (), _collisions(base))], []
    for k, ((mass, com, shape), place) in enumerate(zip(links, places, strict=True)):
        solid = Inertial(mass, Transform.of(xyz=com), frozen(np.eye(3) * 0.02 * mass))
        made.append(Link(f"link{k}", solid, (), _collisions(shape)))
        joint = Joint(f"joint{k}", kind, made[k].name, f"link{k}", Transform.of(xyz=place), frozen(axis), limits)
        joints.append(joint)
    return RobotModel("bench", "base", tuple(made), tuple(joints), (), (), (), Transform.identity(), "", friction=1.0)


def _collisions(shape: Shape | None) -> tuple[Geometry, ...]:
    return () if shape is None else (Geometry(Transform.identity(), shape),)


BYSTANDER: Final = robot([(1.0, (0.0, 0.0, 0.0), None)], "prismatic", (0.0, 0.0, 1.0), [(0.0, 0.0, 5.0)])
"""A robot without shapes, held by its brake."""


class Bench:
    """A world that is stepped with one command."""

    def __init__(self, engine: Engine, modes: Sequence[Mode]) -> None:
        self.engine = engine
        self.command = JointCommand(len(modes))
        self.command.obey(modes)
        engine.write(self.command)

    def run(self, seconds: float, step: float = STEP) -> Bench:
        """Step for so long."""
        for _ in range(round(seconds / step)):
            self.engine.advance()
        return self

    def force(self) -> float:
        """The sum of all normal forces [N]."""
        return sum(contact.force for contact in self.engine.contacts())

    @property
    def places(self) -> Array:
        """(m, 3) [m] of the movable bodies, copied."""
        return np.array(self.engine.read().body_position)

    @property
    def velocities(self) -> Array:
        """(m, 3) [m/s] of the movable bodies, copied."""
        return np.array(self.engine.read().body_linear)


@contextmanager
def opened(
    name: str,
    bodies: Sequence[Body],
    model: RobotModel = BYSTANDER,
    *,
    modes: Sequence[Mode] = ("brake",),
    step: float = STEP,
    gravity: float = G,
    start: Sequence[float] | None = None,
    own: dict[str, Any] | None = None,
) -> Iterator[Bench]:
    """A world of the engine; `own`: fields of its settings."""
    member = ENGINES[name]
    settings = EngineSettings(
        step, 1, np.zeros(len(modes)) if start is None else frozen(start), member.spec.model_validate(own or {})
    )
    engine = member.open(model, Scene(tuple(bodies), (), frozen((0.0, 0.0, -gravity))), settings)
    try:
        yield Bench(engine, modes)
    finally:
        engine.close()
