"""The robot file: a description (URDF or xacro) and what URDF cannot say."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.quantity import (
    Angle,
    JointAcceleration,
    JointEffort,
    JointJerk,
    JointValue,
    JointVelocity,
    Length,
)

Vector3 = tuple[Length, Length, Length]


class PoseSpec(Model):
    """A pose: translation, and at most one way to say the rotation (fixed-axis roll, pitch, yaw; or a quaternion)."""

    xyz: Vector3 = (0.0, 0.0, 0.0)
    rpy: tuple[Angle, Angle, Angle] | None = None
    quat_xyzw: tuple[float, float, float, float] | None = None


class ChainSpec(Model):
    """The independent joints on the way from link `base` to link `tip`."""

    base: str
    tip: str


class GroupSpec(Model):
    """Joints that are planned and named together: a `chain`, or a list of `joints` (`tip`: the link they end in)."""

    chain: ChainSpec | None = None
    joints: tuple[str, ...] | None = None
    tip: str | None = None


class LimitsSpec(Model):
    """What replaces or completes the URDF's limits of a joint; lower/upper may only narrow them."""

    lower: JointValue | None = None
    upper: JointValue | None = None
    velocity: Annotated[JointVelocity, Field(gt=0)] | None = None
    effort: Annotated[JointEffort, Field(gt=0)] | None = None
    acceleration: Annotated[JointAcceleration, Field(gt=0)] | None = None
    jerk: Annotated[JointJerk, Field(gt=0)] | None = None


class AttachSpec(Model):
    """A further description welded onto this one: its root link at `pose` of the link `parent`."""

    description: str
    args: dict[str, str | int | float | bool] = {}
    parent: str
    pose: PoseSpec = PoseSpec()
    prefix: str = ""


PosePart = tuple[JointValue, ...] | dict[str, JointValue] | str
"""Joint values of a group in its order, by joint name, or the name of another pose of the same group."""


class ToolSpec(Model):
    """The tool frame T: a pose in a link. Its +z is the approach direction of `pick`."""

    link: str
    pose: PoseSpec = PoseSpec()


class RobotSpec(Model):
    """One robot."""

    robot: str
    description: str
    args: dict[str, str | int | float | bool] = {}
    mount: PoseSpec = PoseSpec()
    attach: tuple[AttachSpec, ...] = ()
    groups: dict[str, GroupSpec] = {}
    poses: dict[str, dict[str, PosePart]] = {}
    tool: ToolSpec | None = None
    limits: dict[str, LimitsSpec] = {}
    default_acceleration: Annotated[JointAcceleration, Field(gt=0)] = 10.0
    collision_ignore: tuple[tuple[str, str], ...] = ()
    compat: Literal["ros1", "ros2"] = "ros2"
