"""The task file: which robot and controllers, what stands around, what to do, what to expect.

`steps`, `until` and `expect` hold members of seams; the loader builds their unions from the registry, so this module
imports no member. A step is a mapping with exactly one verb key beside the common keys of `StepSpec`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.quantity import Angle, Length, Mass, Time
from manipcli.spec.robot import PoseSpec, Vector3

Fraction = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[Length, Field(gt=0)]


class SimulationSpec(Model):
    """Engine and clock. `control_period` is a whole multiple of `step`; `settle` is simulated before the start."""

    engine: str = "pybullet"
    step: Annotated[Time, Field(gt=0, le=0.02)] = 0.001
    control_period: Annotated[Time, Field(gt=0, le=0.1)] = 0.001
    seed: Annotated[int, Field(ge=0)] = 0
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    settle: Annotated[Time, Field(ge=0)] = 0.5


class BoxSpec(Model):
    """A solid box; its frame is at its centre."""

    size: tuple[Positive, Positive, Positive]


class SphereSpec(Model):
    """A solid sphere; its frame is at its centre."""

    radius: Positive


class CylinderSpec(Model):
    """A solid upright cylinder; its frame is in the middle of its bottom."""

    radius: Positive
    height: Positive


class CupSpec(Model):
    """An open cup: a floor disc and a ring of `segments` wall boxes; outer radius; its frame is in the middle of its bottom."""

    radius: Positive
    height: Positive
    wall: Positive = 0.004
    segments: Annotated[int, Field(ge=6, le=64)] = 16


class TraySpec(Model):
    """An open tray: floor and four walls; outer size; its frame is in the middle of its bottom."""

    size: tuple[Positive, Positive, Positive]
    wall: Positive = 0.005


class MeshSpec(Model):
    """A mesh file (STL, OBJ, Collada), used as its convex hull."""

    file: str
    scale: Annotated[float, Field(gt=0)] = 1.0


class UrdfSpec(Model):
    """A single-link URDF file as an object."""

    file: str


class BodySpec(Model):
    """One thing in the scene: exactly one shape key, one way to place it, and how it behaves in contact.

    Placement: `pose` (world), or `rests_on: BODY` with `at: [x, y]` (world; yaw by `yaw`), or `inside: CONTAINER`.
    """

    box: BoxSpec | None = None
    sphere: SphereSpec | None = None
    cylinder: CylinderSpec | None = None
    cup: CupSpec | None = None
    tray: TraySpec | None = None
    mesh: MeshSpec | None = None
    urdf: UrdfSpec | None = None
    pose: PoseSpec | None = None
    rests_on: str | None = None
    at: tuple[Length, Length] | None = None
    yaw: Angle = 0.0
    inside: str | None = None
    fixed: bool = False
    mass: Annotated[Mass, Field(gt=0)] | None = None
    friction: Annotated[float, Field(ge=0)] = 0.8
    rolling_friction: Annotated[float, Field(ge=0)] = 0.0
    spinning_friction: Annotated[float, Field(ge=0)] = 0.0
    restitution: Fraction = 0.0
    color: tuple[Fraction, Fraction, Fraction, Fraction] | None = None


class FrameSpec(Model):
    """A named frame, fixed in `parent`: `world` or a body of the scene."""

    parent: str = "world"
    pose: PoseSpec = PoseSpec()


class StepSpec(Model):
    """What every step has beside its one verb key. `body` is the validated block under the verb."""

    id: str | None = None
    until: Any = None
    timeout: Annotated[Time, Field(gt=0)] | None = None


class TaskSpec(Model):
    """The task. The loader replaces `steps` and `expect` by the unions that the registry offers."""

    task: str
    robot: str
    controllers: str
    description: str = ""
    params: dict[str, float | str] = {}
    simulation: SimulationSpec = SimulationSpec()
    floor: bool = True
    scene: dict[str, BodySpec] = {}
    frames: dict[str, FrameSpec] = {}
    start: str | None = None
    steps: tuple[Any, ...] = Field(min_length=1)
    expect: tuple[Any, ...] = ()
