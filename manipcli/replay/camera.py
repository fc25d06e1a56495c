"""Cameras: view directions and framing of a drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array, Transform, rotate
from manipcli.core.text import shorten
from manipcli.render.drawing import Drawing
from manipcli.render.lens import Lens
from manipcli.render.placing import Poses

Vector = tuple[float, float, float]

FROM: Vector = (1.0, 0.75, 0.55)
"""Default direction from the scene to the camera: front left of a robot that faces along x."""
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
    """A camera at `eye` that looks at `target` [m] in the world, z up; `field`: vertical field of view [deg]."""

    eye: Vector
    target: Vector
    field: float = FIELD

    @property
    def distance(self) -> float:
        """Distance from the eye to the target [m]."""
        return float(np.linalg.norm(np.subtract(self.eye, self.target)))

    @property
    def near(self) -> float:
        """Distance of the near clipping plane [m]."""
        return self.distance / 50.0

    @property
    def far(self) -> float:
        """Distance of the far clipping plane [m]."""
        return self.distance * 12.0

    @property
    def up(self) -> Vector:
        """Up direction of the picture: z, or x if the camera looks along z."""
        along = np.abs(np.subtract(self.target, self.eye)) / self.distance
        return (1.0, 0.0, 0.0) if along[2] > 1.0 - 1e-6 else (0.0, 0.0, 1.0)

    def project(self, points: Array, size: tuple[int, int]) -> tuple[Array, Array, Array]:
        """Pixel coordinates of points (..., 3) in the world, for a picture of this width and height.

        Returns:
            x to the right and y down [pixel] from the upper left corner, and the depth [m] along the line of sight;
            x and y are meaningless if the depth is not positive.
        """
        local = self.X_WC.inverse().apply(points)
        depth = local[..., 2]
        focal = self.lens(size).fy
        ahead = np.where(depth > 0.0, depth, np.nan)
        x, y = (size[k] / 2.0 + focal * local[..., k] / ahead for k in range(2))
        return x, y, depth

    @property
    def X_WC(self) -> Transform:
        """Pose of the optical frame (z forward, x right, y down) in the world."""
        forward = np.subtract(self.target, self.eye) / self.distance
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        return Transform.of(xyz=self.eye, R=np.stack([right, np.cross(forward, right), forward], axis=1))

    def lens(self, size: tuple[int, int]) -> Lens:
        """The pinhole of a picture of this width and height [pixel]."""
        width, height = size
        focal = height / 2.0 / math.tan(math.radians(self.field) / 2.0)
        return Lens(width, height, focal, focal, (width - 1) / 2.0, (height - 1) / 2.0)

    def further(self, factor: float) -> Camera:
        """The camera at `factor` times its distance from the target."""
        eye = np.add(self.target, factor * np.subtract(self.eye, self.target))
        return Camera(_vector(eye), self.target, self.field)


def direction(text: str) -> Vector:
    """Direction from the scene to the camera: a name of `VIEWS`, or azimuth and elevation [deg], `30,20`.

    Azimuth 0 shows the front of a robot that faces along x, 90 its left side; elevation 90 is from above.

    Raises:
        InvalidArgument: the text is neither.
    """
    if text in VIEWS:
        return VIEWS[text]
    parts = text.split(",")
    try:
        azimuth, elevation = (math.radians(float(part)) for part in parts)
    except ValueError:
        azimuth = elevation = math.nan
    if not math.isfinite(azimuth) or not abs(elevation) <= math.pi / 2.0:
        hint = f"views: {', '.join(VIEWS)}; or azimuth,elevation in degrees, such as 30,20"
        raise InvalidArgument("REPLAY010", f"'{shorten(text)}' is not a view", hint=hint)
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
    """The nearest camera that has everything in view.

    Args:
        drawing: the drawing.
        poses: one state, or several that are all in view.
        aspect: width over height of the picture.
        leave_out: frames that need not be in view, such as the floor.
        towards: direction from the scene to the camera.
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
    # The centre of the projection is not the centre of the bounding box: shift, step back, repeat.
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
    """(p, 3) points to have in view: all vertices for one state, bounding boxes of the surfaces for several."""
    index = {name: k for k, name in enumerate(drawing.frames)}
    shown = [
        drawable
        for drawable in drawing.layer("visual")
        if drawable.frame not in leave_out and len(drawable.surface.vertices)
    ]
    position, quat = poses.position, poses.quat_xyzw
    clouds = [
        position[..., index[drawable.frame], None, :] + rotate(quat[..., index[drawable.frame], None, :], points)
        for drawable in shown
        for points in [drawable.surface.vertices if position.ndim == 2 else drawable.surface.corners]
    ]
    return np.concatenate([cloud.reshape(-1, 3) for cloud in clouds]) if clouds else position.reshape(-1, 3)


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
