"""What a robot is: links, joints, groups, named poses, transmissions. Immutable; built once from a description.

Frames: L link, J joint (coincides with its child link), P parent link, B robot base, W world.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal

from manipcli.core.errors import Place
from manipcli.core.geometry import Array, Transform

JointType = Literal["revolute", "continuous", "prismatic", "fixed"]


Rgba = tuple[float, float, float, float]
"""A colour: red, green, blue and opacity, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Box:
    """Centred at its frame; `size` (3,) [m]: full edge lengths along x, y, z."""

    size: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Sphere:
    """`radius` [m], centred at its frame."""

    radius: float


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Axis along z, centred at its frame; `radius` and `length` [m]."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Mesh:
    """A mesh file: `uri` as `package://NAME/...`, `path` where it was found, `scale` per axis."""

    uri: str
    path: Path
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


Shape = Box | Sphere | Cylinder | Mesh


@dataclass(frozen=True, slots=True)
class Geometry:
    """A shape placed in the frame of a link or an object; `rgba` only matters to what is drawn."""

    X_LS: Transform
    shape: Shape
    rgba: Rgba | None = None


@dataclass(frozen=True, slots=True)
class Inertial:
    """`mass` [kg]; `X_LI`: inertial frame (origin at the centre of mass) in the link; `inertia` (3, 3) [kg m2] in I."""

    mass: float
    X_LI: Transform
    inertia: Array


@dataclass(frozen=True, slots=True)
class Link:
    """`place`: where the description has it."""

    name: str
    inertial: Inertial | None
    visuals: tuple[Geometry, ...]
    collisions: tuple[Geometry, ...]
    place: Place | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class SoftLimits:
    """Where a joint is slowed down before its limits (URDF's safety_controller); `control/limits.py` has the law.

    Attributes:
        lower, upper: rad or m; None: none on this side.
        k_position: velocity per distance to them [1/s]; 0: they do not act.
        k_velocity: effort per velocity beyond what they allow [N m s/rad or N s/m]; 0: efforts are not bounded.
    """

    lower: float | None = None
    upper: float | None = None
    k_position: float = 0.0
    k_velocity: float = 0.0


@dataclass(frozen=True, slots=True)
class JointLimits:
    """SI: rad or m, and per second. None is unlimited (`lower`, `upper`) or not stated (the rest)."""

    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    soft: SoftLimits | None = None

    @property
    def range(self) -> tuple[float, float]:
        """`lower` and `upper`, infinite where there is none."""
        return -math.inf if self.lower is None else self.lower, math.inf if self.upper is None else self.upper

    @property
    def within_soft(self) -> tuple[float, float]:
        """The part of the `range` within the soft limits that act: from beyond these a joint is led back."""
        lower, upper = self.range
        soft = self.soft
        if soft is None or soft.k_position <= 0.0:
            return lower, upper
        least, most = lower if soft.lower is None else soft.lower, upper if soft.upper is None else soft.upper
        return max(lower, least), min(upper, most)

    def is_soft(self, side: int) -> bool:
        """Whether the lower (0) or the upper (1) end of `within_soft` is a soft limit."""
        return self.within_soft[side] != self.range[side]

    def nearest(self, position: float) -> float:
        """The position within the limits that is nearest to this one."""
        lower, upper = self.range
        return min(max(position, lower), upper)


@dataclass(frozen=True, slots=True)
class Mimic:
    """position = multiplier * position of `joint` + offset."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Joint:
    """`X_PJ`: joint frame in the parent link at zero position; `axis` (3,) unit, in J. Damping N m s/rad or N s/m."""

    name: str
    type: JointType
    parent: str
    child: str
    X_PJ: Transform
    axis: Array
    limits: JointLimits
    mimic: Mimic | None = None
    damping: float = 0.0
    friction: float = 0.0

    @property
    def moves(self) -> bool:
        return self.type != "fixed"

    @property
    def independent(self) -> bool:
        """Moves and follows no other joint: what a controller may command."""
        return self.moves and self.mimic is None

    @property
    def unit(self) -> Literal["rad", "m"]:
        """Of its position."""
        return "m" if self.type == "prismatic" else "rad"

    def meant(self, position: float) -> str | None:
        """The hint where a position beyond the limits lies within them as degrees, or as millimetres.

        Only for more than a turn or 5 m: less may as well be a position that is too far.
        """
        what, unit, size, few = (
            ("millimetres", "mm", 1000.0, 5.0) if self.unit == "m" else ("degrees", "deg", 180.0 / math.pi, math.tau)
        )
        lower, upper = self.limits.range
        if lower <= position <= upper or abs(position) <= few or not lower <= position / size <= upper:
            return None
        return f"in {what}? write '{position:g} {unit}'"

    @property
    def effort_unit(self) -> Literal["N m", "N"]:
        """Of its effort."""
        return "N" if self.type == "prismatic" else "N m"

    @property
    def inertia_unit(self) -> Literal["kg m2", "kg"]:
        """Of what resists its acceleration."""
        return "kg" if self.type == "prismatic" else "kg m2"


@dataclass(frozen=True, slots=True)
class Group:
    """Independent joints that are planned and named together. `tip`: the link that poses of the group speak of."""

    name: str
    joints: tuple[str, ...]
    tip: str | None = None


@dataclass(frozen=True, slots=True)
class NamedPose:
    """Position of some joints, parallel tuples; rad or m."""

    name: str
    joints: tuple[str, ...]
    positions: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Tool:
    """The tool frame T at `X_LT` of `link`: +z is the direction of approach, y the one in which fingers close."""

    link: str
    X_LT: Transform


@dataclass(frozen=True, slots=True)
class TransmissionTag:
    """A `<transmission>`, roles resolved: parallel tuples in role order, as many actuators as joints.

    A simple one has its reduction at the actuator, wherever it was written; its joint reduction is 1.
    """

    name: str
    type: str
    joints: tuple[str, ...]
    joint_reductions: tuple[float, ...]
    joint_offsets: tuple[float, ...]
    actuators: tuple[str, ...]
    actuator_reductions: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Actuator:
    """A motor in front of its gear, in its own units: N m and rad, or N and m. The defaults are those of an ideal one.

    Attributes:
        effort: the most that it gives [N m or N]; None: unlimited.
        velocity: beyond it nothing is left to drive with [rad/s or m/s]; None: unlimited.
        rotor_inertia: of what turns with it [kg m2 or kg].
        viscous_friction: [N m s/rad or N s/m].
        coulomb_friction: [N m or N].
        efficiency: share of its effort that reaches the joints while it drives them.
        latency: control ticks from a command to its effort.
    """

    name: str
    effort: float | None = None
    velocity: float | None = None
    rotor_inertia: float = 0.0
    viscous_friction: float = 0.0
    coulomb_friction: float = 0.0
    efficiency: float = 1.0
    latency: int = 0


@dataclass(frozen=True, eq=False)
class RobotModel:
    """The robot. Joints stand in depth-first order from the root; a joint's parent link comes before its child link.

    `urdf` is the normalised description (package:// mesh URIs kept) that the log carries;
    `X_WB` places the root link in the world; `friction` is the coefficient of its surfaces in contact;
    `collision_ignore` are pairs of links that planning never checks against each other; `compat` says whose four-bar
    linkages these are, where ROS 1 and ROS 2 differ. `actuators` are those of which something is known.
    """

    name: str
    root: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    groups: tuple[Group, ...]
    poses: tuple[NamedPose, ...]
    transmissions: tuple[TransmissionTag, ...]
    X_WB: Transform
    urdf: str
    tool: Tool | None = None
    collision_ignore: tuple[tuple[str, str], ...] = ()
    friction: float = 1.0
    compat: Literal["ros1", "ros2"] = "ros2"
    actuators: tuple[Actuator, ...] = ()

    @cached_property
    def moving_joints(self) -> tuple[Joint, ...]:
        """Every joint that moves, mimics included: the order of all joint vectors (n,) in the program."""
        return tuple(joint for joint in self.joints if joint.moves)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of `moving_joints`."""
        return tuple(joint.name for joint in self.moving_joints)

    @cached_property
    def following(self) -> tuple[str, ...]:
        """Names of the joints that follow others (mimic): nobody commands them."""
        return tuple(joint.name for joint in self.moving_joints if joint.mimic is not None)

    @cached_property
    def _joints(self) -> dict[str, Joint]:
        return {joint.name: joint for joint in self.joints}

    @cached_property
    def _links(self) -> dict[str, Link]:
        return {link.name: link for link in self.links}

    def joint(self, name: str) -> Joint:
        return self._joints[name]

    def link(self, name: str) -> Link:
        return self._links[name]

    def group(self, name: str) -> Group:
        return next(group for group in self.groups if group.name == name)

    def pose(self, name: str) -> NamedPose:
        return next(pose for pose in self.poses if pose.name == name)

    def indices(self, joints: tuple[str, ...]) -> list[int]:
        """Where these joints stand in a joint vector."""
        return [self.joint_names.index(name) for name in joints]

    def descendants(self, link: str) -> frozenset[str]:
        """Names of `link` and of every link below it."""
        found = {link}
        for joint in self.joints:
            if joint.parent in found:
                found.add(joint.child)
        return frozenset(found)
