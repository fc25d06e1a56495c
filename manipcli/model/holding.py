"""Attachment of an object to the tool by a suction cup or a weld: when it is made, and the loads at which it breaks.

A suction cup pulls with its force F along the tool's z axis, and friction mu holds against shear. With the force f of
the tool on the object, in the tool frame, the pull p = -f_z and the shear s = |(f_x, f_y)|, it holds while

    s <= mu (F - p)      or      (p + s / mu) / F <= 1

and while the torque about the tool frame is below its limit. A weld breaks at the sizes of force and torque.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.core.units import readable
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Sphere

CUP_RADIUS: Final = 0.01
"""[m] Lever arm of the default torque of a suction cup."""
FACING: Final = math.cos(math.radians(30.0))
"""Least cosine between the tool's z axis and the direction to the surface that a cup grips."""
_PROBE: Final = 1e-5  # [m] radius of the sphere at the tool frame whose distance is computed
_BEHIND: Final = 1e-4  # [m]


class Load(NamedTuple):
    """The load of an attachment as a share of what it holds, and in words."""

    share: float
    text: str


class Surface(NamedTuple):
    """The surface of an object in front of the tool: `gap` [m], and the cosine to its direction from the z axis."""

    gap: float
    facing: float


@dataclass(frozen=True, slots=True)
class Holding:
    """What an attachment holds.

    Attributes:
        kind: of the attachment.
        force: [N] largest pull of a suction cup, or largest force of a weld; infinite: unlimited.
        torque: [N m] largest torque about the tool frame.
        reach: [m] largest gap at which it is made.
    """

    kind: Literal["suction", "weld"]
    force: float
    torque: float
    reach: float = 0.001

    @property
    def limits(self) -> str:
        """`suction (60 N)`, `weld`."""
        return f"{self.kind} ({readable(self.force, 'N')})" if math.isfinite(self.force) else self.kind

    def held(self, body: str) -> str:
        """What reports say of an object that it holds."""
        return f"'{body}' held by {self.limits}, no friction grasp"

    def load(self, wrench: Array, mu: float) -> Load:
        """The load of a wrench (6,) [N, N m] of the tool on the object, in the tool frame and about its origin.

        `mu`: coefficient of friction between cup and object.
        """
        torque = float(np.linalg.norm(wrench[3:]))
        twisted = Load(torque / self.torque, f"torque {torque:.3g} N m, limit {self.torque:.3g} N m")
        if self.kind == "weld":
            force = float(np.linalg.norm(wrench[:3]))
            return max(Load(force / self.force, f"force {force:.3g} N, limit {self.force:.3g} N"), twisted)
        pull, shear = -float(wrench[2]), math.hypot(float(wrench[0]), float(wrench[1]))
        if mu * pull >= shear:
            text = f"pull {pull:.3g} N and shear {shear:.3g} N, suction {self.force:.3g} N"
        else:
            text = f"shear {shear:.3g} N, friction {mu:.3g} holds {mu * (self.force - pull):.3g} N"
        if shear > 0.0 and not mu:
            return Load(math.inf, text)
        return max(Load((pull + (shear / mu if shear else 0.0)) / self.force, text), twisted)

    def missed(self, surface: Surface, body: str) -> str:
        """Why it cannot be made at this surface; "" if it can."""
        if surface.gap > self.reach:
            gap, reach = readable(surface.gap, "m"), readable(self.reach, "m")
            return f"the surface of '{body}' is {gap} from the tool frame, the reach is {reach}"
        if surface.facing < FACING:
            angle = math.degrees(math.acos(max(-1.0, surface.facing)))
            return f"the surface of '{body}' is tilted by {angle:.0f} deg to the tool's z axis, the limit is 30 deg"
        return ""


def surface(body: Body, X_WO: Transform, X_WT: Transform) -> Surface:
    """The surface of a body nearest to the origin of the tool frame; a negative gap is a depth."""
    gap, facing = _ahead(body, X_WO, X_WT)
    if not math.isfinite(facing):  # exactly on the surface there is no direction to it: look from a little behind
        facing = _ahead(body, X_WO, X_WT @ Transform.of(xyz=(0.0, 0.0, -_BEHIND)))[1]
    return Surface(gap, facing if math.isfinite(facing) else -1.0)


def _ahead(body: Body, X_WO: Transform, X_WT: Transform) -> tuple[float, float]:
    """[m] gap of the surface nearest to the tool frame, and the cosine to its direction, which may be NaN."""
    from manipcli.shapes.proximity import coal_shape, distance

    probe = coal_shape(Sphere(_PROBE))
    found = (distance(probe, X_WT, coal_shape(g.shape), X_WO @ g.X_LS) for g in body.geometries)
    nearest = min(found, key=lambda each: each.distance)
    return nearest.distance + _PROBE, float(nearest.normal @ X_WT.R[:, 2])
