"""How well the robot knows where a body is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen, matrix_from_axis_angle
from manipcli.spec.known import KnownSpec

UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class Known:
    """The body is within this of its believed pose.

    Attributes:
        half: (3,) [m] half lengths of a box along the axes of the world.
        radius: [m] of a level disc, instead of the box; else None.
        edge: whether it is on the circle of that radius.
        rotation: [rad] about the vertical, either way.
    """

    half: Array
    radius: float | None
    rotation: float
    edge: bool = False

    @staticmethod
    def of(spec: KnownSpec) -> Known:
        region = spec.region
        box = (0.0, 0.0, 0.0) if region is None or region.box is None else region.box
        radius = None if region is None else region.radius or region.circle
        return Known(frozen(np.array(box) / 2.0), radius, spec.rotation, region is not None and bool(region.circle))

    def error(self, deviates: tuple[float, float, float, float]) -> tuple[Array, float]:
        """An error drawn uniformly: position (3,) [m] and rotation [rad]; the deviates are uniform in (0, 1)."""
        a, b, c, turn = deviates
        if self.radius is not None:
            far, angle = self.radius * (1.0 if self.edge else math.sqrt(a)), 2.0 * math.pi * b
            offset = np.array([far * math.cos(angle), far * math.sin(angle), 0.0])
        else:
            offset = self.half * (2.0 * np.array([a, b, c]) - 1.0)
        return offset, self.rotation * (2.0 * turn - 1.0)

    @property
    def covariance(self) -> Array:
        """(6, 6) of position [m2] and rotation [rad2] about x, y, z of the world: uniform within the box of half
        lengths h, h^2 / 3; within the disc of radius r, r^2 / 4, on its
        edge r^2 / 2; within the rotation +-a, a^2 / 3."""
        if self.radius is not None:
            flat = self.radius**2 / (2.0 if self.edge else 4.0)
            position = np.array([flat, flat, 0.0])
        else:
            position = self.half**2 / 3.0
        return np.diag([*position, 0.0, 0.0, self.rotation**2 / 3.0])


def displaced(X_WO: Transform, offset: Array, rotation: float) -> Transform:
    """A pose moved by `offset` (3,) [m], and rotated by `rotation` [rad] about the vertical through its origin."""
    return Transform(R=frozen(matrix_from_axis_angle(UP, rotation) @ X_WO.R), p=frozen(X_WO.p + offset))
