"""How well the robot knows where a body is, and which bodies a container holds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen, matrix_from_axis_angle
from manipcli.scene.scene import Body, Interior
from manipcli.shapes.primitives import Cylinder
from manipcli.spec.known import KnownSpec

UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class Known:
    """The body is within this of its believed pose.

    Attributes:
        half: (3,) [m] half lengths of a box along the axes of the world.
        radius: [m] of a level disc, instead of the box; else None.
        rotation: [rad] about the vertical, either way.
    """

    half: Array
    radius: float | None
    rotation: float

    @staticmethod
    def of(spec: KnownSpec) -> Known:
        region = spec.region
        box = (0.0, 0.0, 0.0) if region is None or region.box is None else region.box
        return Known(frozen(np.array(box) / 2.0), None if region is None else region.radius, spec.rotation)

    def error(self, deviates: tuple[float, float, float, float]) -> tuple[Array, float]:
        """An error drawn uniformly: position (3,) [m] and rotation [rad]; the deviates are uniform in (0, 1)."""
        a, b, c, turn = deviates
        if self.radius is not None:
            far, angle = self.radius * math.sqrt(a), 2.0 * math.pi * b
            offset = np.array([far * math.cos(angle), far * math.sin(angle), 0.0])
        else:
            offset = self.half * (2.0 * np.array([a, b, c]) - 1.0)
        return offset, self.rotation * (2.0 * turn - 1.0)

    @property
    def covariance(self) -> Array:
        """(6, 6) of position [m2] and rotation [rad2] about x, y, z of the world: uniform within the box of half
        lengths h, h^2 / 3; within the disc of radius r, r^2 / 4; within the rotation +-a, a^2 / 3."""
        if self.radius is not None:
            flat = self.radius**2 / 4.0
            position = np.array([flat, flat, 0.0])
        else:
            position = self.half**2 / 3.0
        return np.diag([*position, 0.0, 0.0, self.rotation**2 / 3.0])


def displaced(X_WO: Transform, offset: Array, rotation: float) -> Transform:
    """A pose moved by `offset` (3,) [m], and rotated by `rotation` [rad] about the vertical through its origin."""
    return Transform(R=frozen(matrix_from_axis_angle(UP, rotation) @ X_WO.R), p=frozen(X_WO.p + offset))


def within(interior: Interior, X_WC: Transform, points: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(k,) whether points (k, 3) [m] of the world are in the interior of a container at X_WC."""
    X_WS = X_WC @ interior.X_OS
    local = (points - X_WS.p) @ X_WS.R
    if isinstance(interior.shape, Cylinder):
        level = np.hypot(local[:, 0], local[:, 1]) < interior.shape.radius
        return np.asarray(level & (np.abs(local[:, 2]) < interior.shape.length / 2.0))
    return np.asarray(np.all(np.abs(local) < np.array(interior.shape.size) / 2.0, axis=1))


def contains(container: Body, X_WC: Transform, body: Body, X_WO: Transform) -> bool:
    """Whether the centre of a body at X_WO is in the interior of a container at X_WC."""
    if container.interior is None or container.name == body.name:
        return False
    return bool(within(container.interior, X_WC, X_WO.apply(body.centre)[None])[0])
