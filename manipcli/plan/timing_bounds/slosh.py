"""Apparent gravity at the contents of a held cup, within a cone about the cup's axis: nothing is spilt by acceleration.

With f = a - g the direction in which the contents feel "up" (minus the apparent gravity g - a) and z the cup's axis,

    |f - (f z) z| <= tan(angle) (f z)

which a surface of a liquid at rest keeps within `angle` of the rim's plane. The cone is replaced by planes inside it.
"""

from __future__ import annotations

import math

import numpy as np

from manipcli.core.geometry import Array, Transform, rotate_inverse
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.timing_bound import Terms, TimingBound

_SIDES = 32


class SloshBound(TimingBound):
    """The values are 1 + h f / |g| <= 1 with the normals h of the planes."""

    name = "slosh"
    subject = "contents"

    def __init__(self, dynamics: PathDynamics, link: str, X_LC: Transform, gravity: Array, angle: float) -> None:
        """
        Args:
            dynamics: of the path's joints.
            link, X_LC: the frame C at the contents; its z axis is the cup's.
            gravity: (3,) [m/s2] in the world.
            angle: of the cone, from its axis to its side [rad].
        """
        self._dynamics = dynamics
        self._frame = link, X_LC
        self._gravity = gravity
        self._g = float(np.linalg.norm(gravity))
        self._angle = self.limit = angle
        turn = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        inner = math.tan(angle) * math.cos(math.pi / _SIDES)
        self._inner = np.stack((np.cos(turn), np.sin(turn), np.full(_SIDES, -inner)), axis=1)

    def still(self, q: Array, direction: Array) -> Array:
        zero = np.zeros_like(q)
        quat, _, _ = self._dynamics.points(q, zero, zero, *self._frame)
        return 1.0 + self._planes(quat, -self._gravity)

    def moving(self, q: Array, v: Array, a: Array) -> Array:
        quat, _, acceleration = self._dynamics.points(q, v, a, *self._frame)
        return self._planes(quat, acceleration)

    def values(self, q: Array, v: Array, a: Array) -> Array:
        """The angle over the largest one, exactly; the planes are only for the timing."""
        return self.angles(q, v, a)[:, None] / self._angle

    def angles(self, q: Array, v: Array, a: Array) -> Array:
        """(k) between the apparent "up" and the cup's axis [rad]."""
        quat, _, acceleration = self._dynamics.points(q, v, a, *self._frame)
        f = rotate_inverse(quat, acceleration - self._gravity)
        return np.asarray(np.arctan2(np.hypot(f[:, 0], f[:, 1]), f[:, 2]))

    def terms(self, q: Array, first: Array, second: Array) -> Terms:
        zero = np.zeros_like(first)
        return Terms(self.moving(q, zero, first), self.moving(q, first, second), self.still(q, first) - 1.0)

    def text(self, q: Array, v: Array, a: Array) -> str:
        angle = math.degrees(float(self.angles(q[None], v[None], a[None])[0]))
        limit = math.degrees(self._angle)
        return f"the apparent gravity is {angle:.1f} deg from the cup's axis, beyond `slosh: {limit:g} deg`"

    def _planes(self, quat: Array, vectors: Array) -> Array:
        """(k, m) products of the planes' normals with vectors of the world, (k, 3) or (3,), over |g|."""
        return np.asarray(rotate_inverse(quat, vectors) @ self._inner.T / self._g)
