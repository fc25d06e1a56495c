"""The robot file: a description (URDF or xacro) and what URDF cannot say."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from manipcli.core.text import shorten
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import (
    JointAcceleration,
    JointEffort,
    JointJerk,
    JointValue,
    JointVelocity,
    Length,
    Turn,
)

if TYPE_CHECKING:
    from manipcli.core.geometry import Transform

Vector3 = tuple[Length, Length, Length]
_VERSION = re.compile(r"\d+\.\d+\.\d+")


def _three_numbers(version: str | None) -> str | None:
    if version is not None and not _VERSION.fullmatch(version):
        raise problem("conflict", f"'{shorten(version)}' is no version: expected three numbers, as '0.1.0'")
    return version


Version = Annotated[
    str | None,
    Field(
        description="The least version of manipcli that reads this file, as '0.1.0'.",
        json_schema_extra={"pattern": rf"^{_VERSION.pattern}$"},
    ),
    AfterValidator(_three_numbers),
]
Arguments = dict[str, bool | int | float | str]

UNIT_TOLERANCE = 1e-3
"""How far the length of an axis or of a quaternion may be from 1 without a word."""


class PoseSpec(Model):
    """A pose: translation, and at most one way to say the rotation (fixed-axis roll, pitch, yaw; or a quaternion)."""

    xyz: Vector3 = Field((0.0, 0.0, 0.0), description="Translation [m]. Default [0, 0, 0].")
    rpy: tuple[Turn, Turn, Turn] | None = Field(
        None, description="Roll, pitch, yaw about the fixed x, y, z axes [rad]. Default: no rotation."
    )
    quat_xyzw: tuple[float, float, float, float] | None = Field(
        None, description="Unit quaternion, real part last; of length 1 within 0.001."
    )

    @model_validator(mode="after")
    def _one_rotation(self) -> PoseSpec:
        if self.quat_xyzw is None:
            return self
        if self.rpy is not None:
            message = "the rotation is said twice: by rpy and by quat_xyzw"
            raise problem("conflict", message, at=("quat_xyzw",), key=True)
        norm = math.sqrt(sum(q * q for q in self.quat_xyzw))
        if abs(norm - 1.0) > UNIT_TOLERANCE:
            hint = "the order is x, y, z, w: no rotation is [0, 0, 0, 1]"
            raise problem("range", f"not a unit quaternion: its length is {norm:.6g}", at=("quat_xyzw",), hint=hint)
        return self

    @property
    def transform(self) -> Transform:
        """The transform that it says."""
        from manipcli.core.geometry import Transform

        return Transform.of(xyz=self.xyz, rpy=self.rpy, quat_xyzw=self.quat_xyzw)


class ChainSpec(Model):
    """The independent joints on the way from link `base` to link `tip`."""

    base: str = Field(description="The link above the first joint.")
    tip: str = Field(description="The link below the last joint.")


class GroupSpec(Model):
    """Joints that are planned and named together: a `chain`, or a list of `joints` (`tip`: the link they end in)."""

    chain: ChainSpec | None = Field(None, description="All independent joints between two links.")
    joints: tuple[str, ...] | None = Field(None, description="The joints by name; their order is that of poses.")
    tip: str | None = Field(None, description="The link that poses of the group speak of.")


class LimitsSpec(Model):
    """What replaces or completes the URDF's limits of a joint; lower/upper may only narrow them."""

    lower: JointValue | None = Field(None, description="Least position [rad or m]; not below the URDF's.")
    upper: JointValue | None = Field(None, description="Greatest position [rad or m]; not above the URDF's.")
    velocity: Annotated[JointVelocity, Field(gt=0)] | None = Field(None, description="[rad/s or m/s], above 0.")
    effort: Annotated[JointEffort, Field(gt=0)] | None = Field(None, description="[N m or N], above 0.")
    acceleration: Annotated[JointAcceleration, Field(gt=0)] | None = Field(
        None, description="[rad/s^2 or m/s^2], above 0. Default: `default_acceleration`."
    )
    jerk: Annotated[JointJerk, Field(gt=0)] | None = Field(
        None, description="[rad/s^3 or m/s^3], above 0. Default: unlimited."
    )
    soft_lower: JointValue | None = Field(
        None,
        description="Where a joint slows down before `lower` [rad or m]; plans stay within it. It needs k_position. "
        "Default: nowhere.",
    )
    soft_upper: JointValue | None = Field(
        None,
        description="Where a joint slows down before `upper` [rad or m]; plans stay within it. It needs k_position. "
        "Default: nowhere.",
    )
    k_position: Annotated[float, Field(ge=0)] | None = Field(
        None, description="Velocity per distance to a soft limit [1/s]. Default: the description's, or 0: none."
    )
    k_velocity: Annotated[float, Field(ge=0)] | None = Field(
        None,
        description="Effort per velocity beyond the allowed [N m s/rad or N s/m]. Default: the description's, or 0.",
    )

    @model_validator(mode="after")
    def _ordered(self) -> LimitsSpec:
        if self.lower is not None and self.upper is not None and self.lower > self.upper:
            raise problem("conflict", f"lower ({self.lower:g}) is above upper ({self.upper:g})", at=("lower",))
        return self


TransmissionType = Literal["simple", "differential", "four_bar"]


class TransmissionSpec(Model):
    """Actuators and the joints that they drive, in the order of their roles: one of each, or two.

    It replaces what the description says about these joints.
    """

    type: TransmissionType = Field(
        "simple", description="simple (1:1), differential or four_bar (2:2). Default simple."
    )
    joints: tuple[str, ...] = Field(description="The joint, or joint1 and joint2.")
    actuators: tuple[str, ...] = Field(description="The actuator, or actuator1 and actuator2.")
    actuator_reduction: tuple[float, ...] | None = Field(
        None, description="Per actuator, not 0: its turns a turn of the joint; negative reverses. Default 1."
    )
    joint_reduction: tuple[float, ...] | None = Field(
        None, description="Per joint, not 0: a second reduction, behind the coupling of a pair. Default 1."
    )
    joint_offset: tuple[JointValue, ...] | None = Field(
        None, description="Per joint: its position where the actuators are at 0 [rad or m]. Default 0."
    )

    @model_validator(mode="after")
    def _counted(self) -> TransmissionSpec:
        count = 1 if self.type == "simple" else 2
        for key in ("joints", "actuators", "actuator_reduction", "joint_reduction", "joint_offset"):
            values = getattr(self, key)
            if values is None:
                continue
            if len(values) != count:
                message = f"a {self.type} transmission has {count} of each; {key} has {len(values)}"
                raise problem("count", message, at=(key,))
            if key.endswith("reduction"):
                for k, value in enumerate(values):
                    if value == 0.0:
                        raise problem("range", "a reduction of 0 is not possible", at=(key, k))
            elif len({*values}) < count and not key.startswith("joint_"):
                raise problem("duplicate", f"{key} names '{values[0]}' twice", at=(key, 1))
        return self


class ActuatorSpec(Model):
    """A motor in front of its gear, in its own units: N m and rad, or N and m where it moves in a line."""

    effort: Annotated[JointEffort, Field(gt=0)] | None = Field(
        None, description="The most that it gives [N m or N], above 0. Default: unlimited."
    )
    velocity: Annotated[JointVelocity, Field(gt=0)] | None = Field(
        None, description="Beyond it nothing is left to drive with [rad/s or m/s], above 0. Default: unlimited."
    )
    rotor_inertia: Annotated[float, Field(ge=0)] = Field(
        0.0, description="Of what turns with the motor [kg m^2 or kg]; at the joint reduction^2 times that. Default 0."
    )
    viscous_friction: Annotated[float, Field(ge=0)] = Field(
        0.0, description="Friction per velocity [N m s/rad or N s/m]. Default 0."
    )
    coulomb_friction: Annotated[JointEffort, Field(ge=0)] = Field(
        0.0, description="Friction that does not depend on velocity [N m or N]. Default 0."
    )
    efficiency: Annotated[float, Field(gt=0, le=1)] = Field(
        1.0, description="Share of its effort that reaches the joints while it drives them, in (0, 1]. Default 1."
    )
    latency: Annotated[int, Field(ge=0, le=1000)] = Field(
        0, description="Control ticks from a command to its effort, 0 to 1000. Default 0."
    )


def _begins_names(prefix: str) -> str:
    if not re.fullmatch(r"[\w./-]{0,100}", prefix):
        raise problem(
            "conflict", f"'{shorten(prefix)}' cannot begin names", hint="write letters, digits and '_', '.', '/', '-'"
        )
    return prefix


class AttachSpec(Model):
    """A further description welded onto this one: its root link at `pose` of the link `parent`."""

    description: str = Field(description="URDF or xacro file: a path relative to this file, or `package://NAME/...`.")
    args: Arguments = Field({}, description="Arguments of the xacro file.")
    parent: str = Field(description="The link that it is welded to.")
    pose: PoseSpec = Field(PoseSpec(), description="Of its root link in `parent`. Default: coincident.")
    prefix: Annotated[str, AfterValidator(_begins_names)] = Field(
        "",
        description="Put before each of its link and joint names: letters, digits, `_`, `.`, `/`, `-`. Default: "
        "nothing.",
    )


PosePart = tuple[JointValue, ...] | dict[str, JointValue] | str
"""Joint values of a group in its order, by joint name, or the name of another pose of the same group."""


class ToolSpec(Model):
    """The tool frame T: a pose in a link. Its +z is the approach direction of `pick`."""

    link: str = Field(description="The link that carries the tool.")
    pose: PoseSpec = Field(PoseSpec(), description="Of the tool frame in the link. Default: the link's own frame.")


class RobotSpec(Model):
    """A robot: its description, and what URDF cannot say."""

    robot: str = Field(description="The name of the robot.", min_length=1)
    version: Version = None
    description: str = Field(description="URDF or xacro file: a path relative to this file, or `package://NAME/...`.")
    args: Arguments = Field({}, description="Arguments of the xacro file.")
    mount: PoseSpec = Field(PoseSpec(), description="Of the root link in the world. Default: the origin.")
    attach: tuple[AttachSpec, ...] = Field((), description="Further descriptions, welded on.")
    groups: dict[str, GroupSpec] = Field({}, description="Groups of joints, by name.")
    poses: dict[str, dict[str, PosePart]] = Field({}, description="Named poses: per group, joint values or a name.")
    tool: ToolSpec | None = Field(None, description="The tool frame. Default: the tip of the first group.")
    limits: dict[str, LimitsSpec] = Field({}, description="Limits by joint: what URDF cannot say, or narrower ones.")
    transmissions: dict[str, TransmissionSpec] = Field(
        {}, description="Transmissions by name, beside those of the description or instead of them."
    )
    actuators: dict[str, ActuatorSpec] = Field(
        {}, description="What the actuators of transmissions can do, by name. Default: anything."
    )
    default_acceleration: Annotated[JointAcceleration, Field(gt=0)] = Field(
        10.0, description="Limit of joints without their own [rad/s^2 or m/s^2], above 0. Default 10."
    )
    collision_ignore: tuple[tuple[str, str], ...] = Field((), description="Pairs of links that may touch.")
    friction: Annotated[float, Field(ge=0)] = Field(
        1.0, description="Coefficient of the robot's surfaces; the engine multiplies it by the other body's. Default 1."
    )
    compat: Literal["ros1", "ros2"] | None = Field(
        None,
        description="Whose rules where ROS 1 and 2 differ: when the integral of a PID acts (in ROS 1 a step earlier), "
        "what follows an abort (in ROS 1 the trajectory goes on), what goal_time 0 means (in ROS 2 to wait without "
        "end), what becomes of a goal that another replaces, and the efforts of a four-bar linkage (in ROS 1 they do "
        "not keep power). Default: the safer one of each.",
    )
