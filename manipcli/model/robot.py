"""What a robot is: links, joints, groups, named poses, transmissions. Immutable; built once from a description.

Frames: L link, J joint (coincides with its child link), P parent link, B robot base, W world.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from manipcli.core.geometry import Transform
from manipcli.description.elements import (
    Joint,
    Link,
    TransmissionTag,
)


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
