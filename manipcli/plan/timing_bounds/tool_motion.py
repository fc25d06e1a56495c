"""Speed and acceleration of the tool's origin."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.timing_bound import Terms, TimingBound

_SIDES = 32  # of the polygon inside the circle that the acceleration may fill: it costs up to 0.5 %


class ToolBound(TimingBound):
    """Common parts of both."""

    subject = "tool"

    def __init__(self, dynamics: PathDynamics, link: str, X_LT: Transform, limit: float) -> None:
        self._dynamics = dynamics
        self._frame = link, X_LT
        self._limit = self.limit = limit

    def still(self, q: Array, direction: Array) -> Array:
        return np.zeros((len(q), 1))

    def _motion(self, q: Array, v: Array, a: Array) -> tuple[Array, Array]:
        """Velocity and acceleration (k, 3) of the tool's origin."""
        return self._dynamics.points(q, v, a, *self._frame)[1:]


class ToolSpeed(ToolBound):
    """|v| <= limit [m/s], as |v|^2 / limit^2 <= 1."""

    name = "tool_speed"

    def used(self, q: Array, v: Array, a: Array) -> Array:
        return np.sqrt(self.moving(q, v, a)[:, 0])

    def moving(self, q: Array, v: Array, a: Array) -> Array:
        velocity, _ = self._motion(q, v, a)
        return np.asarray(np.sum(velocity**2, axis=1, keepdims=True) / self._limit**2)

    def text(self, q: Array, v: Array, a: Array) -> str:
        speed = float(np.linalg.norm(self._motion(q[None], v[None], a[None])[0]))
        return f"the tool moves at {speed:.3g} m/s, above `tool_speed: {self._limit:g}`"


class ToolAcceleration(ToolBound):
    """|a| <= limit [m/s2]."""

    name = "tool_acceleration"

    def moving(self, q: Array, v: Array, a: Array) -> Array:
        _, acceleration = self._motion(q, v, a)
        return np.asarray(np.linalg.norm(acceleration, axis=1, keepdims=True) / self._limit)

    def terms(self, q: Array, first: Array, second: Array) -> Terms:
        """The acceleration u a' + x b' lies in the plane of two vectors: a polygon in it is inside the circle."""
        _, along = self._motion(q, np.zeros_like(first), first)
        _, bend = self._motion(q, first, second)
        e1 = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
        rest = bend - np.sum(bend * e1, axis=1, keepdims=True) * e1
        e2 = rest / np.maximum(np.linalg.norm(rest, axis=1, keepdims=True), 1e-12)
        angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        scale = 1.0 / (self._limit * np.cos(np.pi / _SIDES))
        axes = np.cos(angle)[:, None, None] * e1 + np.sin(angle)[:, None, None] * e2
        a, b = (scale * np.einsum("mkx,kx->km", axes, each) for each in (along, bend))
        return Terms(a, b, np.full_like(a, -1.0))

    def text(self, q: Array, v: Array, a: Array) -> str:
        value = float(np.linalg.norm(self._motion(q[None], v[None], a[None])[1]))
        return f"the tool accelerates with {value:.3g} m/s2, above `tool_acceleration: {self._limit:g}`"
