"""The robot model: links, joints, groups, named poses, transmissions and actuators, immutable.

Frames: L link, J joint (coincides with its child link), P parent link, B robot base, W world.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

from manipcli.core.geometry import Transform
from manipcli.core.text import digits
from manipcli.description.elements import (
    Joint,
    Link,
    Pin,
    TransmissionTag,
)
from manipcli.model.holding import Holding


@dataclass(frozen=True, slots=True)
class Group:
    """Independent joints that are planned together; `tip`: the link that poses of the group refer to."""

    name: str
    joints: tuple[str, ...]
    tip: str | None = None


@dataclass(frozen=True, slots=True)
class NamedPose:
    """Positions of some joints [rad or m], as parallel tuples."""

    name: str
    joints: tuple[str, ...]
    positions: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Tool:
    """The tool frame T at `X_LT` in `link`: +z is the approach direction, y the direction in which fingers close.

    `holding`: the attachment that holds objects; None: contact and friction do.
    """

    link: str
    X_LT: Transform
    holding: Holding | None = None


@dataclass(frozen=True, slots=True)
class Actuator:
    """A motor on its side of the gear: N m and rad, or N and m. The defaults describe an ideal motor.

    Attributes:
        effort: largest effort [N m or N]; None: unlimited.
        velocity: speed beyond which it has no driving effort [rad/s or m/s]; None: unlimited.
        rotor_inertia: [kg m2 or kg].
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


_INERTIAL: Final = re.compile(
    r"(?P<kind>given|estimated|repaired): (?P<mass>\S+) kg, centre \[(?P<centre>[^]]+)\] m, "
    r"principal moments \[(?P<moments>[^]]+)\] kg m2, from (?P<source>.*)"
)


@dataclass(frozen=True, slots=True)
class LinkInertial:
    """Where the inertial of a link comes from, if not from its description.

    Attributes:
        link: name.
        kind: `given` by the robot file; `estimated`; `repaired`: the mass is the description's, the inertia estimated.
        mass: [kg].
        centre: (3,) [m] centre of mass in the link.
        moments: (3,) [kg m2] principal moments of inertia, increasing.
        source: what was measured: "collision shapes (closed mesh)"; "robot file".
    """

    link: str
    kind: Literal["given", "estimated", "repaired"]
    mass: float
    centre: tuple[float, ...]
    moments: tuple[float, ...]
    source: str

    def __str__(self) -> str:
        centre, moments = (
            ", ".join(f"{round(value, 9) + 0.0:.4g}" for value in values) for values in (self.centre, self.moments)
        )
        return (
            f"{self.kind}: {digits(self.mass)} kg, centre [{centre}] m, principal moments [{moments}] kg m2, "
            f"from {self.source}"
        )

    @classmethod
    def read(cls, link: str, text: str) -> LinkInertial:
        """From its text, as a log has it; of 3 to 4 digits.

        Raises:
            ValueError: it is not such a text.
        """
        found = _INERTIAL.fullmatch(text)
        if found is None:
            raise ValueError(f"not an inertial: {text}")
        centre, moments = (tuple(map(float, found[key].split(", "))) for key in ("centre", "moments"))
        kind: Literal["given", "estimated", "repaired"] = found["kind"]  # type: ignore[assignment]
        return cls(link, kind, float(found["mass"]), centre, moments, found["source"])


@dataclass(frozen=True, eq=False)
class RobotModel:
    """The robot, with joints in depth-first order from the root: parent links come before child links.

    `urdf`: normalised description with package:// mesh URIs, as stored in logs. `X_WB`: pose of the root link in the
    world. `friction`: friction coefficient of its surfaces. `collision_ignore`: pairs of links that planning never
    checks against each other. `compat`: convention of four-bar linkages, which differ between ROS 1 and ROS 2.
    `actuators`: those with known parameters. `inertials`: those that are not the description's.
    `pins`: of closed loops; their passive joints mimic the driving one by a curve.
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
    inertials: tuple[LinkInertial, ...] = ()
    pins: tuple[Pin, ...] = ()

    @property
    def holding(self) -> Holding | None:
        """The attachment that holds objects in the tool; None: contact and friction do."""
        return None if self.tool is None else self.tool.holding

    @cached_property
    def moving_joints(self) -> tuple[Joint, ...]:
        """Every joint that moves, including mimic joints: the order of all joint vectors (n,)."""
        return tuple(joint for joint in self.joints if joint.moves)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of `moving_joints`."""
        return tuple(joint.name for joint in self.moving_joints)

    @cached_property
    def following(self) -> tuple[str, ...]:
        """Names of the mimic joints, which cannot be commanded."""
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
        """Indices of these joints in a joint vector."""
        return [self.joint_names.index(name) for name in joints]

    def descendants(self, link: str) -> frozenset[str]:
        """Names of `link` and of every link below it."""
        found = {link}
        for joint in self.joints:
            if joint.parent in found:
                found.add(joint.child)
        return frozenset(found)
