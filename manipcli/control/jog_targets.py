"""Targets of jogging: velocities of joints, and the velocity of the tool.

The tool's velocity x = J(q) v is followed by the pseudo-inverse. Where joints reach their bounds, they are saturated
one by one and the others make up for them, as long as they can; then the tool slows down along x, so that its direction
is kept (Flacco, De Luca, Khatib: Motion control of redundant robots under joint constraints: Saturation in the Null
Space, ICRA 2012).

Towards a singularity the tool slows down along x, too. The part of x that belongs to a small singular value s of J
needs joint velocities of its size divided by s. They are kept below

    min(sqrt(`BRAKE` s), `NEAR` s)

so that the joints come to rest where s is 0, and leave from there. Only where this part of x is `NEGLIGIBLE`, it does
not slow down the others. Damped least squares would let the tool slide off its line instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.configuration import with_joints
from manipcli.model.kinematics import Kinematics

SINGULAR: Final = 0.02
"""Joints are not saturated where the others would have a singular value below this."""
BRAKE: Final = 20.0
"""[rad/s2] per unit of s. Joints stop before a singularity if they can brake with BRAKE ds/dq / 2, where ds/dq is below
0.5 for common arms."""
NEAR: Final = 100.0
"""[rad/s] per unit of s: very near, s decays without a step."""
NEGLIGIBLE: Final = 1e-3
"""Relative to x."""
NEVER: Final = 1e-9
"""A singular value below this is that of a direction in which these joints never move the tool; it is left out."""
TASK: Final = 6


@dataclass(frozen=True, slots=True, eq=False)
class JointTarget:
    """Velocities (n) [rad/s or m/s]; a joint at its bound does not slow down the others."""

    velocity: Array

    def wish(self, q: Array) -> JointTarget:
        """The same at every configuration."""
        return self

    def within(self, lower: Array, upper: Array) -> Array:
        """(n) each within its own bounds."""
        return np.clip(self.velocity, lower, upper)


class ToolTarget:
    """A velocity of the tool frame T: linear of its origin [m/s], then angular [rad/s].

    Args:
        kinematics: of the robot; used by one thread at a time.
        joints: (n) those that are jogged.
        rest: positions of all joints of the robot [rad or m]; the others stay there.
        tool: the link of T and X_LT.
        twist: (6) along the axes of a frame.
        axes: this frame: a link of the robot, whose motion it follows; "": T itself; None: the world.
    """

    def __init__(
        self,
        kinematics: Kinematics,
        joints: Sequence[str],
        rest: Array,
        tool: tuple[str, Transform],
        twist: Array,
        *,
        axes: str | None,
    ) -> None:
        self._kinematics, self._joints, self._rest = kinematics, tuple(joints), rest
        self._link, self._offset = tool
        self._twist, self._axes = twist.reshape(2, 3), axes
        still = np.zeros(len(rest))
        self._moved = with_joints(kinematics.robot, still, self._joints, np.eye(len(joints)), rates=True)

    def wish(self, q: Array) -> TaskVelocity:
        """The joint velocities at `q` (n)."""
        kinematics = self._kinematics
        full = with_joints(kinematics.robot, self._rest, self._joints, q)
        R, _, J = kinematics.pose_and_jacobian(full, self._link, self._offset)
        if self._axes is None:
            R = np.eye(3)
        elif self._axes:
            R = kinematics.forward(full, self._axes).R
        return TaskVelocity(J @ self._moved.T, (self._twist @ R.T).reshape(TASK))


class TaskVelocity:
    """Joint velocities v with J v = x.

    Args:
        J: (6, n).
        x: (6).
    """

    def __init__(self, J: Array, x: Array) -> None:
        U, values, Vt = np.linalg.svd(J, full_matrices=False)
        parts = x @ U
        most = np.minimum(np.sqrt(BRAKE * values), NEAR * values)
        allowed = values * most + NEGLIGIBLE * np.sqrt(np.vdot(x, x))
        sizes, possible = np.abs(parts), values > NEVER
        scale = np.divide(allowed, sizes, out=np.ones_like(sizes), where=possible & (sizes > 0.0)).min(initial=1.0)
        self._J, self._x = J, float(scale) * x
        speeds = np.divide(scale * parts, values, out=np.zeros_like(values), where=possible)
        self.velocity: Array = np.clip(speeds, -most, most) @ Vt

    def within(self, lower: Array, upper: Array) -> Array:
        """(n) with J v = s x and the largest s <= 1 that is found within the bounds; see the module."""
        J, x = self._J, self._x
        along, beside = self.velocity, np.zeros_like(self.velocity)
        best, chosen = 0.0, beside
        free = np.ones(len(along), dtype=np.bool_)
        while True:
            scale, worst = _scale(along, beside, lower, upper)
            if scale > best:
                best, chosen = scale, scale * along + beside
            if scale >= 1.0 or free.sum() <= min(TASK, len(free)):
                return chosen
            bound = np.clip(along[worst] + beside[worst], lower[worst], upper[worst])
            beside = np.where(free, 0.0, beside)
            beside[worst], free[worst] = bound, False
            U, values, Vt = np.linalg.svd(J * free, full_matrices=False)
            if values[min(TASK, len(free)) - 1] < SINGULAR:
                return chosen
            inverse = (Vt.T / values) @ U.T
            along, beside = inverse @ x, beside - inverse @ (J @ beside)


def _scale(along: Array, beside: Array, lower: Array, upper: Array) -> tuple[float, int]:
    """The largest s <= 1 with s `along` + `beside` within the bounds (all (n)), and the joint that limits it; 0: none.

    Joints that do not move along are not limited by it.
    """
    moves = np.abs(along) > 1e-12
    ends = np.where(along > 0.0, upper, lower) - beside
    begins = np.where(along > 0.0, lower, upper) - beside
    most = np.divide(ends, along, out=np.full_like(along, np.inf), where=moves)
    least = np.divide(begins, along, out=np.zeros_like(along), where=moves)
    worst = int(most.argmin())
    scale = min(1.0, float(most[worst]))
    still = ~moves & ((beside > upper + 1e-12) | (beside < lower - 1e-12))
    return (0.0 if scale < least.max() or still.any() else scale), worst
