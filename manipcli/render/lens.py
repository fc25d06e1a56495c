"""The pinhole camera: pixels to rays and points to pixels, in the optical frame.

Optical frame C (REP 103): z forward, x right, y down. The centre of the pixel in column u and row v has the image
coordinates (u, v), so that the upper left corner of the picture is at (-0.5, -0.5), as in OpenCV and `CameraInfo`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array

Depth = npt.NDArray[np.float32] | npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Lens:
    """A pinhole without distortion.

    Attributes:
        width, height: of the picture [pixel].
        fx, fy: focal lengths [pixel].
        cx, cy: principal point [pixel].
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @classmethod
    def of_field(cls, width: int, height: int, field: float) -> Lens:
        """A lens with square pixels and its principal point in the middle; `field`: horizontal field of view [rad]."""
        focal = width / 2.0 / math.tan(field / 2.0)
        return cls(width, height, focal, focal, (width - 1) / 2.0, (height - 1) / 2.0)

    @property
    def columns(self) -> Array:
        """(width) x of the ray through the pixels of each column, at z = 1."""
        found: Array = (np.arange(self.width, dtype=np.float64) - self.cx) / self.fx
        return found

    @property
    def rows(self) -> Array:
        """(height) y of the ray through the pixels of each row, at z = 1."""
        found: Array = (np.arange(self.height, dtype=np.float64) - self.cy) / self.fy
        return found

    def points(self, depth: Depth) -> Depth:
        """(height, width, 3) points in the optical frame [m] at these depths (height, width) along z."""
        cloud: Depth = np.empty((*depth.shape, 3), dtype=depth.dtype)
        np.multiply(depth, self.columns.astype(depth.dtype), out=cloud[..., 0])
        np.multiply(depth, self.rows.astype(depth.dtype)[:, None], out=cloud[..., 1])
        cloud[..., 2] = depth
        return cloud

    def project(self, points: Array) -> Array:
        """(..., 2) image coordinates [pixel] of points (..., 3) in the optical frame, with positive z."""
        x, y, z = (points[..., k] for k in range(3))
        return np.stack([self.fx * (x / z) + self.cx, self.fy * (y / z) + self.cy], axis=-1)
