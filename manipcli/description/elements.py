"""Links, joints and transmission tags of a URDF as immutable dataclasses.

Frames: L link, J joint (coincides with its child link), P parent link.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import Diagnostic, Place
from manipcli.core.geometry import Array, Transform
from manipcli.shapes.primitives import Geometry

JointType = Literal["revolute", "continuous", "prismatic", "fixed"]


@dataclass(frozen=True, slots=True)
class Inertial:
    """`mass` [kg]; `X_LI`: inertial frame I in the link, at the centre of mass; `inertia` (3, 3) [kg m2] in I."""

    mass: float
    X_LI: Transform
    inertia: Array


@dataclass(frozen=True, slots=True)
class UnusableInertial:
    """An inertial that no engine can use: the findings about it, and what of it is usable (None: unknown)."""

    findings: tuple[Diagnostic, ...]
    mass: float | None = None
    X_LI: Transform | None = None


@dataclass(frozen=True, slots=True)
class Link:
    """A link; `place`: its position in the description file.

    `unusable`: an inertial that was refused. `missing`: the errors about collision meshes that cannot be used.
    """

    name: str
    inertial: Inertial | None
    visuals: tuple[Geometry, ...]
    collisions: tuple[Geometry, ...]
    place: Place | None = field(default=None, compare=False)
    unusable: UnusableInertial | None = field(default=None, compare=False)
    missing: tuple[Diagnostic, ...] = field(default=(), compare=False)


@dataclass(frozen=True, slots=True)
class SoftLimits:
    """Soft limits of a joint (URDF's safety_controller); `control/limit_laws.py` implements them.

    Attributes:
        lower, upper: [rad or m]; None: no soft limit on this side.
        k_position: velocity limit per distance to a soft limit [1/s]; 0: `lower` and `upper` have no effect.
        k_velocity: effort limit per velocity excess [N m s/rad or N s/m]; 0: efforts are not limited.
    """

    lower: float | None = None
    upper: float | None = None
    k_position: float = 0.0
    k_velocity: float = 0.0


@dataclass(frozen=True, slots=True)
class JointLimits:
    """SI: rad or m, and per second. None: unlimited (`lower`, `upper`) or unknown (the rest)."""

    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    soft: SoftLimits | None = None

    @property
    def range(self) -> tuple[float, float]:
        """`lower` and `upper`, infinite if unlimited."""
        return -math.inf if self.lower is None else self.lower, math.inf if self.upper is None else self.upper

    @property
    def within_soft(self) -> tuple[float, float]:
        """The part of `range` inside the active soft limits; beyond these a joint is driven back."""
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
        """The position within the limits nearest to `position`."""
        lower, upper = self.range
        return min(max(position, lower), upper)


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A smooth function of a joint: (k) values `y` with `slopes` at evenly spaced `x`, between them cubic (Hermite).

    Beyond the ends it goes on straight.
    """

    x: Array
    y: Array
    slopes: Array

    def at(self, position: npt.ArrayLike, *, rate: bool = False) -> Array:
        """(...) values at these positions, or their derivatives."""
        position = np.asarray(position, dtype=np.float64)
        inside = np.clip(position, self.x[0], self.x[-1])
        h = float(self.x[1] - self.x[0])
        k = np.clip(((inside - self.x[0]) / h).astype(np.intp), 0, len(self.x) - 2)
        t = (inside - self.x[k]) / h
        y0, y1, m0, m1 = self.y[k], self.y[k + 1], h * self.slopes[k], h * self.slopes[k + 1]
        c, d = 3.0 * (y1 - y0) - 2.0 * m0 - m1, 2.0 * (y0 - y1) + m0 + m1
        slope = (m0 + t * (2.0 * c + 3.0 * t * d)) / h
        return np.asarray(slope if rate else y0 + t * (m0 + t * (c + t * d)) + slope * (position - inside))


@dataclass(frozen=True, slots=True)
class Mimic:
    """position = multiplier * position of `joint` + offset.

    With a `curve`, of a joint that a closed loop of links moves, the position is its value, and the line its chord.
    """

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0
    curve: Curve | None = field(default=None, compare=False)

    def follow(self, leader: Array) -> Array:
        """Positions (...) for these of the driving joint."""
        return self.multiplier * leader + self.offset if self.curve is None else self.curve.at(leader)

    def ratio(self, leader: Array) -> Array | float:
        """Velocity per velocity of the driving joint, where that is at `leader` (...)."""
        return self.multiplier if self.curve is None else self.curve.at(leader, rate=True)


@dataclass(frozen=True, slots=True, eq=False)
class Pin:
    """A pin that closes a loop: the `points` (3,) of two links, each in its frame, coincide. `driver`: the joint that
    moves the loop."""

    links: tuple[str, str]
    points: tuple[Array, Array]
    driver: str


@dataclass(frozen=True, slots=True)
class Joint:
    """`X_PJ`: joint frame in the parent link at position zero; `axis`: unit vector (3,) in J.

    `damping` [N m s/rad or N s/m], `friction` [N m or N].
    """

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
        """Whether the joint moves and is not a mimic joint, so that a controller may command it."""
        return self.moves and self.mimic is None

    @property
    def unit(self) -> Literal["rad", "m"]:
        return "m" if self.type == "prismatic" else "rad"

    def meant(self, position: float) -> str | None:
        """The hint for a position outside the limits that would be inside as degrees or millimetres; else None.

        Only beyond one revolution or 5 m: a smaller value may just be too far.
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
        return "N" if self.type == "prismatic" else "N m"

    @property
    def inertia_unit(self) -> Literal["kg m2", "kg"]:
        return "kg" if self.type == "prismatic" else "kg m2"


@dataclass(frozen=True, slots=True)
class TransmissionTag:
    """A `<transmission>` with resolved roles: parallel tuples in role order, as many actuators as joints.

    A simple transmission has its reduction at the actuator, wherever it was written; its joint reduction is 1.
    """

    name: str
    type: str
    joints: tuple[str, ...]
    joint_reductions: tuple[float, ...]
    joint_offsets: tuple[float, ...]
    actuators: tuple[str, ...]
    actuator_reductions: tuple[float, ...]
