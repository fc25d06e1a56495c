"""Where to look from."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array, rotate
from manipcli.core.text import shorten
from manipcli.replay.drawing import Drawing
from manipcli.replay.placing import Poses

Vector = tuple[float, float, float]

FROM: Vector = (1.0, 0.75, 0.55)
"""The direction from the middle of what is shown to the eye: the front left of a robot that looks along x."""
FIELD = 38.0
VIEWS: dict[str, Vector] = {
    "iso": FROM,
    "front": (1.0, 0.0, 0.25),
    "back": (-1.0, 0.0, 0.25),
    "left": (0.0, 1.0, 0.25),
    "right": (0.0, -1.0, 0.25),
    "top": (0.0, 0.0, 1.0),
}


@dataclass(frozen=True, slots=True)
class Camera:
    """Looks from `eye` at `target` [m] in the world, z up; `field` of view from top to bottom [deg]."""

    eye: Vector
    target: Vector
    field: float = FIELD

    @property
    def distance(self) -> float:
        """[m] from the eye to the target."""
        return float(np.linalg.norm(np.subtract(self.eye, self.target)))

    @property
    def near(self) -> float:
        """[m] What is nearer to the eye is not drawn."""
        return self.distance / 50.0

    @property
    def far(self) -> float:
        """[m] What is further from the eye is not drawn."""
        return self.distance * 12.0

    @property
    def up(self) -> Vector:
        """What is up in the picture: z, or x where the camera looks along z."""
        along = np.abs(np.subtract(self.target, self.eye)) / self.distance
        return (1.0, 0.0, 0.0) if along[2] > 1.0 - 1e-6 else (0.0, 0.0, 1.0)

    def project(self, points: Array, size: tuple[int, int]) -> tuple[Array, Array, Array]:
        """Where points (..., 3) of the world are in a picture of that width and height.

        Returns:
            x to the right and y down [pixel] from its upper left corner, and the depth [m] along the line of sight;
            x and y mean nothing where that is not positive.
        """
        forward = np.subtract(self.target, self.eye) / self.distance
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        local = np.asarray(points) - np.asarray(self.eye)
        depth = local @ forward
        scale = size[1] / 2.0 / math.tan(math.radians(self.field) / 2.0)
        ahead = np.where(depth > 0.0, depth, np.nan)
        x = size[0] / 2.0 + scale * (local @ right) / ahead
        y = size[1] / 2.0 - scale * (local @ np.cross(right, forward)) / ahead
        return x, y, depth

    def further(self, factor: float) -> Camera:
        """The same from `factor` times as far away."""
        eye = np.add(self.target, factor * np.subtract(self.eye, self.target))
        return Camera(_vector(eye), self.target, self.field)


def direction(text: str) -> Vector:
    """From what is shown to the eye: a name of `VIEWS`, or azimuth and elevation [deg], `30,20`.

    Azimuth 0 looks at the front of a robot that looks along x, 90 at its left side; elevation 90 is from above.

    Raises:
        InvalidArgument: it is neither.
    """
    if text in VIEWS:
        return VIEWS[text]
    parts = text.split(",")
    try:
        azimuth, elevation = (math.radians(float(part)) for part in parts)
    except ValueError:
        azimuth = elevation = math.nan
    if not math.isfinite(azimuth) or not abs(elevation) <= math.pi / 2.0:
        hint = f"views: {', '.join(VIEWS)}; or azimuth and elevation in degrees, 30,20"
        raise InvalidArgument("REPLAY010", f"'{shorten(text)}' is no view", hint=hint)
    flat = math.cos(elevation)
    return (flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation))


def framing(
    drawing: Drawing,
    poses: Poses,
    *,
    aspect: float = 4 / 3,
    leave_out: frozenset[str] = frozenset(),
    towards: Vector = FROM,
) -> Camera:
    """A camera that has everything in view, as near as that allows.

    Args:
        drawing: what is shown.
        poses: one instant, or several that are all to be in view.
        aspect: width over height of the picture.
        leave_out: frames that need not be in view, as the floor.
        towards: from what is shown to the eye.
    """
    points = _points(drawing, poses, leave_out)
    backward = np.array(towards) / np.linalg.norm(towards)
    above = (1.0, 0.0, 0.0) if abs(backward[2]) > 1.0 - 1e-6 else (0.0, 0.0, 1.0)
    right = np.cross(above, backward)
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


def _points(drawing: Drawing, poses: Poses, leave_out: frozenset[str]) -> Array:
    """(p, 3) what is to be in view: all vertices of one instant, the boxes around surfaces of several."""
    index = {name: k for k, name in enumerate(drawing.frames)}
    shown = [one for one in drawing.layer("visual") if one.frame not in leave_out and len(one.surface.vertices)]
    position, quat = poses.position, poses.quat_xyzw
    clouds = [
        position[..., index[one.frame], None, :] + rotate(quat[..., index[one.frame], None, :], points)
        for one in shown
        for points in [one.surface.vertices if position.ndim == 2 else one.surface.corners]
    ]
    return np.concatenate([each.reshape(-1, 3) for each in clouds]) if clouds else position.reshape(-1, 3)


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
