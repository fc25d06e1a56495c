"""What stands in for a link of which no shape can be drawn: bones from its frame to the joints below it."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel
from manipcli.replay.surface import Surface, cylinder_surface, sphere_surface
from manipcli.shapes.primitives import Cylinder, Sphere

THICKEST: Final = 0.02
"""Radius of a bone [m] at most."""
SLENDERNESS: Final = 8.0
"""Length of a bone over its radius at least."""
SHORTEST: Final = 1e-3
"""[m] A joint closer than this to the frame of its link needs no bone."""
END: Final = 0.01
"""Radius [m] of the ball that ends a link without joints below it."""


def bones(robot: RobotModel, link: str) -> tuple[Surface, ...]:
    """One a joint below the link, in the link's frame and where the joint is at zero; a ball where there is none."""
    ends = [joint.X_PJ.p for joint in robot.joints if joint.parent == link]
    found = tuple(_bone(end) for end in ends if np.linalg.norm(end) > SHORTEST)
    return found or (sphere_surface(Sphere(END)),)


def _bone(end: Array) -> Surface:
    length = float(np.linalg.norm(end))
    z = end / length
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z], axis=1)
    cylinder = Cylinder(radius=min(THICKEST, length / SLENDERNESS), length=length)
    return cylinder_surface(cylinder).moved(Transform.of(xyz=end / 2.0, R=R))
