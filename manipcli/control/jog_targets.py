"""Targets of jogging: velocities of joints, and the velocity of the tool.

The tool's velocity x = J(q) v is followed by damped least squares. Where joints reach their bounds, they are saturated
one by one and the others make up for them, as long as they can; then the tool slows down along x, so that its direction
is kept (Flacco, De Luca, Khatib: Motion control of redundant robots under joint constraints: Saturation in the Null
Space, ICRA 2012). Near a singularity, where a singular value of J is below `SINGULAR`, the inverse is damped by up to
`DAMPING` (Nakamura, Hanafusa: Inverse kinematic solutions with singularity robustness, 1986): the tool is then slower
than asked, or leaves its direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, Transform
from manipcli.model.configuration import with_joints
from manipcli.model.kinematics import Kinematics

SINGULAR: Final = 0.02
"""Singular values of J below this are damped; m/s or rad/s of the tool per rad/s or m/s of the joints."""
DAMPING: Final = 0.02
"""Largest damping, at a singularity: joint velocities are at most |x| / (2 DAMPING)."""
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
        self._J, self._x = J, x
        self.velocity: Array = damped_inverse(J)[0] @ x

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
            beside = np.where(free, 0.0, beside)
            beside[worst] = np.clip(along[worst] + beside[worst], lower[worst], upper[worst])
            free[worst] = False
            inverse, least = damped_inverse(J * free)
            if least < SINGULAR:
                return chosen
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


def damped_inverse(J: npt.NDArray[np.float64]) -> tuple[Array, float]:
    """The pseudo-inverse (n, 6) of `J` (6, n), damped near singularities, and its least singular value.

    Columns of zeros do not count for that value, as if the joint were absent.
    """
    U, values, Vt = np.linalg.svd(J, full_matrices=False)
    rank = min(TASK, int(J.any(axis=0).sum()))
    least = float(values[rank - 1]) if rank else 0.0
    damping = DAMPING**2 * max(0.0, 1.0 - (least / SINGULAR) ** 2)
    inverted = np.divide(values, values**2 + damping, out=np.zeros_like(values), where=values > 1e-12)
    return (Vt.T * inverted) @ U.T, least
