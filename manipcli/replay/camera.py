"""Where to look from."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array
from manipcli.replay.drawing import Drawing
from manipcli.replay.placing import Poses

Vector = tuple[float, float, float]

FROM: Vector = (1.0, 0.75, 0.55)
"""The direction from the middle of what is shown to the eye: the front left of a robot that looks along x."""
FIELD = 38.0


@dataclass(frozen=True, slots=True)
class Camera:
    """Looks from `eye` at `target` [m] in the world, z up; `field` of view from top to bottom [deg]."""

    eye: Vector
    target: Vector
    field: float = FIELD

    def further(self, factor: float) -> Camera:
        """The same from `factor` times as far away."""
        eye = np.add(self.target, factor * np.subtract(self.eye, self.target))
        return Camera(_vector(eye), self.target, self.field)


def framing(
    drawing: Drawing, poses: Poses, *, aspect: float = 4 / 3, leave_out: frozenset[str] = frozenset()
) -> Camera:
    """A camera that has everything in view, as near as that allows.

    Args:
        drawing: what is shown.
        poses: one instant.
        aspect: width over height of the picture.
        leave_out: frames that need not be in view, as the floor.
    """
    index = {name: k for k, name in enumerate(drawing.frames)}
    shown = [one for one in drawing.layer("visual") if one.frame not in leave_out]
    clouds = [poses.X_WF(index[one.frame]).apply(one.surface.vertices) for one in shown]
    points = np.concatenate([*clouds, np.zeros((0, 3))])
    if not len(points):
        points = poses.position
    backward = np.array(FROM) / np.linalg.norm(FROM)
    right = np.cross([0.0, 0.0, 1.0], backward)
    right /= np.linalg.norm(right)
    up = np.cross(backward, right)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    high = 1.1 * math.tan(math.radians(FIELD) / 2.0)
    slope = np.array([high / 1.21 * aspect, high / 1.21])
    distance = 0.1
    # The middle of what is seen is not that of the box about it: shift, then step back, and once more.
    for _ in range(2):
        local = points - middle
        depth = local @ backward
        across = np.stack([local @ right, local @ up], axis=1)
        distance = max(float((np.abs(across) / slope + depth[:, None]).max()), 0.1)
        seen = across / (distance - depth)[:, None]
        shift = (seen.min(axis=0) + seen.max(axis=0)) / 2.0 * distance
        middle = middle + shift[0] * right + shift[1] * up
    eye = middle + distance * backward
    return Camera(eye=_vector(eye), target=_vector(middle))


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
