"""Spec of a robot file: a description (URDF or xacro) and data that URDF does not hold."""

from __future__ import annotations

import math
import re
from pathlib import PurePath
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from manipcli.core.text import number_of, shorten
from manipcli.spec.base import Model, problem
from manipcli.spec.holding import HoldingSpec
from manipcli.spec.inertials import InertialsSpec
from manipcli.spec.loops import LoopSpec
from manipcli.spec.quantity import (
    JointAcceleration,
    JointEffort,
    JointJerk,
    JointValue,
    JointVelocity,
    Length,
    Turn,
)
from manipcli.spec.sensors import SensorName, SensorSpec

if TYPE_CHECKING:
    from manipcli.core.geometry import Transform

Vector3 = tuple[Length, Length, Length]
_VERSION = re.compile(r"\d+\.\d+\.\d+")


def _three_numbers(version: str | None) -> str | None:
    if version is not None and not _VERSION.fullmatch(version):
        raise problem("conflict", f"'{shorten(version)}' is not a version: expected three numbers such as '0.1.0'")
    return version


Version = Annotated[
    str | None,
    Field(
        description="Minimum version of manipcli that reads this file, such as '0.1.0'.",
        json_schema_extra={"pattern": rf"^{_VERSION.pattern}$"},
    ),
    AfterValidator(_three_numbers),
]
Arguments = dict[str, bool | int | float | str]

UNIT_TOLERANCE = 1e-3
"""Accepted deviation of the norm of an axis or a quaternion from 1."""


class PoseSpec(Model):
    """A pose: a translation and at most one rotation (fixed-axis roll, pitch, yaw; or a quaternion)."""

    xyz: Vector3 = Field((0.0, 0.0, 0.0), description="Translation [m]. Default [0, 0, 0].")
    rpy: tuple[Turn, Turn, Turn] | None = Field(
        None, description="Roll, pitch, yaw about the fixed x, y, z axes [rad]. Default: no rotation."
    )
    quat_xyzw: tuple[float, float, float, float] | None = Field(
        None, description="Unit quaternion, real part last; norm 1 within 0.001."
    )

    @model_validator(mode="after")
    def _one_rotation(self) -> PoseSpec:
        if self.quat_xyzw is None:
            return self
        if self.rpy is not None:
            message = "the rotation is given twice: by rpy and by quat_xyzw"
            raise problem("conflict", message, at=("quat_xyzw",), key=True)
        norm = math.sqrt(sum(q * q for q in self.quat_xyzw))
        if abs(norm - 1.0) > UNIT_TOLERANCE:
            hint = "the order is x, y, z, w; the identity is [0, 0, 0, 1]"
            raise problem("range", f"not a unit quaternion: its norm is {norm:.6g}", at=("quat_xyzw",), hint=hint)
        return self

    @property
    def transform(self) -> Transform:
        """The pose as a transform."""
        from manipcli.core.geometry import Transform

        return Transform.of(xyz=self.xyz, rpy=self.rpy, quat_xyzw=self.quat_xyzw)


class ChainSpec(Model):
    """The independent joints between link `base` and link `tip`."""

    base: str = Field(description="The link above the first joint.")
    tip: str = Field(description="The link below the last joint.")


class GroupSpec(Model):
    """Joints that are planned and named together: a `chain`, or a list of `joints` (`tip`: the link they end in)."""

    chain: ChainSpec | None = Field(None, description="All independent joints between two links.")
    joints: tuple[str, ...] | None = Field(None, description="The joints by name, in the order that poses use.")
    tip: str | None = Field(None, description="The link that Cartesian poses of the group refer to.")


class LimitsSpec(Model):
    """Limits of a joint that replace or complete those of the URDF; lower/upper may only narrow them."""

    lower: JointValue | None = Field(None, description="Lower position limit [rad or m]; not below the URDF's.")
    upper: JointValue | None = Field(None, description="Upper position limit [rad or m]; not above the URDF's.")
    velocity: Annotated[JointVelocity, Field(gt=0)] | None = Field(
        None, description="Velocity limit [rad/s or m/s], above 0."
    )
    effort: Annotated[JointEffort, Field(gt=0)] | None = Field(None, description="Effort limit [N m or N], above 0.")
    acceleration: Annotated[JointAcceleration, Field(gt=0)] | None = Field(
        None, description="Acceleration limit [rad/s^2 or m/s^2], above 0. Default: `default_acceleration`."
    )
    jerk: Annotated[JointJerk, Field(gt=0)] | None = Field(
        None, description="Jerk limit [rad/s^3 or m/s^3], above 0. Default: unlimited."
    )
    soft_lower: JointValue | None = Field(
        None,
        description="Soft limit, where a joint begins to slow down before `lower` [rad or m]; plans stay within it. "
        "Needs k_position. Default: none.",
    )
    soft_upper: JointValue | None = Field(
        None,
        description="Soft limit, where a joint begins to slow down before `upper` [rad or m]; plans stay within it. "
        "Needs k_position. Default: none.",
    )
    k_position: Annotated[float, Field(ge=0)] | None = Field(
        None,
        description="Allowed velocity per distance to the soft limit [1/s]. Default: the description's, or 0: none.",
    )
    k_velocity: Annotated[float, Field(ge=0)] | None = Field(
        None,
        description="Effort per velocity above the allowed one [N m s/rad or N s/m]. Default: the description's, or 0.",
    )

    @model_validator(mode="after")
    def _ordered(self) -> LimitsSpec:
        if self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise problem("conflict", f"lower ({self.lower:g}) is above upper ({self.upper:g})", at=("lower",))
        return self


TransmissionType = Literal["simple", "differential", "four_bar"]


class TransmissionSpec(Model):
    """Actuators and the joints that they drive, in the order of their roles: one of each, or two.

    It replaces the transmissions of these joints in the description.
    """

    type: TransmissionType = Field(
        "simple", description="simple (1:1), differential or four_bar (2:2). Default simple."
    )
    joints: tuple[str, ...] = Field(description="The joint, or joint1 and joint2.")
    actuators: tuple[str, ...] = Field(description="The actuator, or actuator1 and actuator2.")
    actuator_reduction: tuple[float, ...] | None = Field(
        None, description="Per actuator, not 0: actuator motion per joint motion; negative reverses. Default 1."
    )
    joint_reduction: tuple[float, ...] | None = Field(
        None, description="Per joint, not 0: a second reduction, behind the coupling of a pair. Default 1."
    )
    joint_offset: tuple[JointValue, ...] | None = Field(
        None, description="Per joint: its position when the actuators are at 0 [rad or m]. Default 0."
    )

    @model_validator(mode="after")
    def _counted(self) -> TransmissionSpec:
        count = 1 if self.type == "simple" else 2
        for key in ("joints", "actuators", "actuator_reduction", "joint_reduction", "joint_offset"):
            values = getattr(self, key)
            if values is None:
                continue
            if len(values) != count:
                message = f"{key} has {number_of(len(values), 'item')}; a {self.type} transmission needs {count}"
                raise problem("count", message, at=(key,))
            if key.endswith("reduction"):
                for k, value in enumerate(values):
                    if value == 0.0:
                        raise problem("range", "a reduction must not be 0", at=(key, k))
            elif len({*values}) < count and not key.startswith("joint_"):
                raise problem("duplicate", f"duplicate '{values[0]}' in {key}", at=(key, 1))
        return self


class ActuatorSpec(Model):
    """A motor, on its own side of the gear: N m and rad, or N and m if it is linear."""

    effort: Annotated[JointEffort, Field(gt=0)] | None = Field(
        None, description="Effort limit [N m or N], above 0. Default: unlimited."
    )
    velocity: Annotated[JointVelocity, Field(gt=0)] | None = Field(
        None, description="Velocity above which it cannot drive [rad/s or m/s], above 0. Default: unlimited."
    )
    rotor_inertia: Annotated[float, Field(ge=0)] = Field(
        0.0, description="Rotor inertia [kg m^2 or kg]; reflected to the joint, reduction^2 times that. Default 0."
    )
    viscous_friction: Annotated[float, Field(ge=0)] = Field(
        0.0, description="Viscous friction [N m s/rad or N s/m]. Default 0."
    )
    coulomb_friction: Annotated[JointEffort, Field(ge=0)] = Field(
        0.0, description="Coulomb friction [N m or N]. Default 0."
    )
    efficiency: Annotated[float, Field(gt=0, le=1)] = Field(
        1.0, description="Share of its effort that reaches the joints while driving, in (0, 1]. Default 1."
    )
    latency: Annotated[int, Field(ge=0, le=1000)] = Field(
        0, description="Control ticks from a command to its effort, 0 to 1000. Default 0."
    )


def _begins_names(prefix: str) -> str:
    if not re.fullmatch(r"[\w./-]{0,100}", prefix):
        raise problem(
            "conflict", f"'{shorten(prefix)}' is not a valid prefix", hint="use letters, digits and '_', '.', '/', '-'"
        )
    return prefix


class AttachSpec(Model):
    """A further description welded onto this one: its root link at `pose` of the link `parent`."""

    description: str = Field(description="URDF or xacro file: a path relative to this file, or `package://NAME/...`.")
    args: Arguments = Field({}, description="Arguments of the xacro file.")
    parent: str = Field(description="The link that it is welded to.")
    pose: PoseSpec = Field(
        PoseSpec(),
        description="Pose of its root link in `parent`; an empty root link `world` is left out. Default: identity.",
    )
    prefix: Annotated[str, AfterValidator(_begins_names)] = Field(
        "",
        description="Prefix of its link and joint names: letters, digits, `_`, `.`, `/`, `-`. Default: none.",
    )


PosePart = tuple[JointValue, ...] | dict[str, JointValue] | str
"""Joint values of a group in its order, by joint name, or the name of another pose of the same group."""


class ToolSpec(Model):
    """The tool frame T: a pose in a link. Its +z is the approach direction of `pick`."""

    link: str = Field(description="The link that carries the tool.")
    pose: PoseSpec = Field(PoseSpec(), description="Pose of the tool frame in the link. Default: identity.")
    holding: HoldingSpec | None = Field(
        None,
        description="What holds a grasped object: contact and friction, a suction cup, or a weld. Default friction.",
    )


def _relative(packages: dict[str, str]) -> dict[str, str]:
    for name, folder in packages.items():
        if PurePath(folder).is_absolute() or folder.startswith("~"):
            hint = "write it relative to this file, or pass --package-path"
            raise problem("conflict", f"'{shorten(folder)}' is an absolute path", at=(name,), hint=hint)
    return packages


class RobotSpec(Model):
    """A robot: its description, and data that URDF does not hold."""

    robot: str = Field(description="The name of the robot.", min_length=1)
    version: Version = None
    description: str = Field(description="URDF or xacro file: a path relative to this file, or `package://NAME/...`.")
    args: Arguments = Field({}, description="Arguments of the xacro file.")
    packages: Annotated[dict[str, str], AfterValidator(_relative)] | None = Field(
        None,
        description="Folders of ROS packages by name, relative to this file. Default: they are searched, see below.",
    )
    mount: PoseSpec = Field(PoseSpec(), description="Pose of the root link in the world. Default: identity.")
    attach: tuple[AttachSpec, ...] = Field((), description="Further descriptions, welded on.")
    groups: dict[str, GroupSpec] = Field({}, description="Groups of joints, by name.")
    poses: dict[str, dict[str, PosePart]] = Field({}, description="Named poses: per group, joint values or a name.")
    tool: ToolSpec | None = Field(None, description="The tool frame. Default: the tip of the first group.")
    limits: dict[str, LimitsSpec] = Field(
        {}, description="Limits by joint, which complete or narrow those of the URDF."
    )
    inertials: InertialsSpec | None = Field(
        None,
        description="Masses, centres and inertias of links, or `estimate`. Default: those of the description.",
    )
    transmissions: dict[str, TransmissionSpec] = Field(
        {}, description="Transmissions by name, which add to those of the description or replace them."
    )
    actuators: dict[str, ActuatorSpec] = Field(
        {}, description="Actuators of the transmissions, by name. Default: ideal actuators."
    )
    default_acceleration: Annotated[JointAcceleration, Field(gt=0)] = Field(
        10.0, description="Acceleration limit of joints without one [rad/s^2 or m/s^2], above 0. Default 10."
    )
    loops: tuple[LoopSpec, ...] | None = Field(
        None, description="Pins that close loops of links, which a URDF cannot hold. Default: none."
    )
    collision_ignore: tuple[tuple[str, str], ...] = Field((), description="Pairs of links that may touch.")
    collision_parts: tuple[str, ...] = Field(
        (),
        description="Links whose collision meshes count as their convex parts, not as one convex hull each (a concave "
        "mesh needs `manipcli[coacd]`). Default: none.",
    )
    collision: Literal["from_visual"] | dict[str, Literal["from_visual", "none"]] | None = Field(
        None,
        description="Collision shapes of links that have none, or whose collision mesh is missing: `from_visual` uses "
        "the visual shapes of all of them; `{LINK: from_visual, LINK: none}` of single links; `none` leaves a link "
        "without contacts. Default: as in the description.",
    )
    friction: Annotated[float, Field(ge=0)] = Field(
        1.0, description="Friction coefficient of the robot; the engine multiplies it by the other body's. Default 1."
    )
    # `unions.robot_model` replaces the type by the union of the registered sensors.
    sensors: dict[SensorName, SensorSpec] | None = Field(None, description="Sensors on its links, by name.")
    compat: Literal["ros1", "ros2"] | None = Field(
        None,
        description="Whose behaviour to follow where ROS 1 and ROS 2 differ: when the integral of a PID acts (ROS 1: "
        "one step earlier), what follows an abort (ROS 1: the trajectory continues), what goal_time 0 means (ROS 2: no "
        "time limit), what happens to a replaced goal, and the efforts of a four-bar linkage (ROS 1: power is not "
        "conserved). Default: the safer behaviour in each case.",
    )
