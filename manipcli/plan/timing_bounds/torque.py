"""Torques of the joints within their effort limits, with what the hand holds, friction and rotor inertia.

    |tau| = |M(q) a + C(q, v) v + g(q) + f_c sign(v) + f_v v| <= tau_max

A joint whose limit leaves no room beside its load at rest is left out: timing cannot help it, and `check` reports it.
"""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.text import distinguished
from manipcli.model.robot import RobotModel
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.timing_bound import TimingBound

ROOM = 0.05
"""Share of an effort limit that the load at rest must leave."""


class TorqueBound(TimingBound):
    """For the joints with an effort limit that their load at rest leaves room in; (k, 2 m) values for m such joints."""

    name = "torque"

    def __init__(self, robot: RobotModel, dynamics: PathDynamics, names: tuple[str, ...], path: Array) -> None:
        """
        Args:
            robot: its limits, damping and friction.
            dynamics: of the path's joints, which are `names` (n).
            path: (k, n) the load at rest is examined at these points.
        """
        joints = [robot.joint(name) for name in names]
        self._joints = joints
        self._dynamics = dynamics
        self._coulomb = np.array([joint.friction for joint in joints])
        self._damping = np.array([joint.damping for joint in joints])
        self._limit = np.array([joint.limits.effort or np.inf for joint in joints])
        zero = np.zeros_like(path)
        self._loads = path, dynamics.torques(path, zero, zero)  # kept, as `still` and `moving` need the same
        load = np.abs(self._loads[1]).max(axis=0) + self._coulomb
        self._kept = np.flatnonzero(np.isfinite(self._limit) & (load <= (1.0 - ROOM) * self._limit))

    @property
    def applies(self) -> bool:
        """Whether it bounds any joint."""
        return len(self._kept) > 0

    def still(self, q: Array, direction: Array) -> Array:
        return self._both(self._load(q) + self._coulomb * np.sign(direction))

    def moving(self, q: Array, v: Array, a: Array) -> Array:
        return self._both(self._dynamics.torques(q, v, a) - self._load(q))

    def viscous(self, v: Array) -> Array | None:
        return self._both(self._damping * v) if self._damping.any() else None

    def values(self, q: Array, v: Array, a: Array) -> Array:
        return self._both(self._dynamics.torques(q, v, a) + self._coulomb * np.sign(v) + self._damping * v)

    def text(self, q: Array, v: Array, a: Array) -> str:
        rub = self._coulomb * np.sign(v) + self._damping * v
        torque = np.abs(self._dynamics.torques(q[None], v[None], a[None])[0] + rub)
        k = self._kept[int(np.argmax((torque / self._limit)[self._kept]))]
        joint = self._joints[k]
        needed, most = distinguished(float(torque[k]), float(self._limit[k]))
        return (
            f"joint '{joint.name}' needs {needed} {joint.effort_unit}; its effort limit is {most} {joint.effort_unit}"
        )

    def _load(self, q: Array) -> Array:
        if self._loads[0] is not q:
            zero = np.zeros_like(q)
            self._loads = q, self._dynamics.torques(q, zero, zero)
        return self._loads[1]

    def _both(self, torque: Array) -> Array:
        share = (torque / self._limit)[:, self._kept]
        return np.concatenate((share, -share), axis=1)
