"""Saturation of joint commands at limits, and of the engine's motors at their effort limits."""

from __future__ import annotations

import sys
from collections.abc import Collection, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.control.command import Mode
from manipcli.core.geometry import Array
from manipcli.model.motor_limits import motor_effort_limits
from manipcli.model.robot import RobotModel

KINDS: Final = ("position", "velocity", "effort", "acceleration", "soft_limit")
"""Kinds of limits, in the order of the rows of `JointLimiter.by_kind`."""
POSITION, VELOCITY, EFFORT, ACCELERATION, SOFT = range(len(KINDS))
_MOST = sys.float_info.max  # below infinity, so that infinity is detected


class Window:
    """Rows of numbers, and whether each lies strictly between its bounds: in two comparisons, not two per row."""

    __slots__ = ("_above", "_all", "_below", "_flags", "_least", "_most", "_values", "arrays", "rows")

    def __init__(self, least: Sequence[Array], most: Sequence[Array]) -> None:
        self._least = np.maximum(np.concatenate(least), -_MOST)
        self._most = np.minimum(np.concatenate(most), _MOST)
        size = len(self._least)
        self._values = np.zeros(size)
        self.rows = tuple(self._values.reshape(len(least), -1))
        self._flags = np.zeros(2 * size, dtype=np.bool_)
        self._above, self._below = self._flags[:size], self._flags[size:]
        self.arrays = self._least, self._most, self._values, self._flags  # for a compiled law
        self._all = b"\x01" * (2 * size)

    def holds(self) -> bool:
        np.greater(self._values, self._least, self._above)
        np.less(self._values, self._most, self._below)
        return self._flags.tobytes() == self._all  # faster than asking numpy whether all are true

    def broken(self) -> npt.NDArray[np.bool_]:
        """(rows, joints) those that did not, at the last call of `holds`."""
        return ~(self._above & self._below).reshape(len(self.rows), -1)


Rows = tuple[slice, slice] | tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]


def rows_of(kinds: Sequence[int], where: npt.NDArray[np.intp]) -> Rows:
    """The `rows` of `Saturation.add`: these kinds of limits, of the joints `where`."""
    return np.array(kinds)[:, np.newaxis], where


class Saturation:
    """The joints that are saturated in a tick, by kind of limit."""

    __slots__ = ("any", "joints", "kinds")

    def __init__(self, n: int) -> None:
        self.joints = np.zeros(n, dtype=np.bool_)
        self.kinds = np.zeros((len(KINDS), n), dtype=np.bool_)
        self.any = False

    def clear(self) -> None:
        self.joints[:], self.kinds[:], self.any = False, False, False

    def add(self, rows: Rows, saturated: npt.NDArray[np.bool_], broken: npt.NDArray[np.bool_]) -> None:
        """Add joints.

        Args:
            rows: which of `kinds`, and which joints.
            saturated: (joints) whether each is.
            broken: (rows, joints) whether the command exceeds that kind of limit; if it exceeds none of them, a soft
                limit has saturated it.
        """
        self.any = True
        where = rows[1]
        self.joints[where] |= saturated
        known = broken & saturated
        self.kinds[rows] |= known
        self.kinds[SOFT, where] |= saturated & ~known.any(axis=0)


ALL: Final = 1.0 - 1e-6
"""Share of its limit above which a motor counts as saturated; engines keep the limit as an impulse, with rounding."""


class MotorLimits:
    """Detects motors at their limits from measured efforts.

    Args:
        robot: the robot.
        pressing: joints that are at their limits by intent: those of hands, which press on what they hold.

    Attributes:
        watches: whether there is any such motor; otherwise `count` need not be called.
    """

    def __init__(self, robot: RobotModel, *, pressing: Collection[str] = ()) -> None:
        self._limits = ALL * motor_effort_limits(robot)
        self._may = np.array([name not in pressing for name in robot.joint_names]) & np.isfinite(self._limits)
        self._at: npt.NDArray[np.intp] = np.zeros(0, dtype=np.intp)
        self._own = self._limits[self._at]
        self.watches = False

    def select(self, modes: Sequence[Mode]) -> None:
        """Set the modes (n) of the joints."""
        driven = np.array([mode in ("position", "velocity") for mode in modes], dtype=np.bool_)
        self._at = np.flatnonzero(driven & self._may)
        self._own = self._limits[self._at]
        self.watches = len(self._at) > 0

    def count(self, effort: Array, saturated: npt.NDArray[np.bool_], *counts: npt.NDArray[np.int64]) -> None:
        """Adds 1 to each of the `counts` (n) of joints whose motor was at its limit in the last tick.

        Args:
            effort: (n) measured [N m or N].
            saturated: (n) joints whose command was saturated in that tick, which are counted already.
            counts: (n), changed in place.
        """
        at = self._at
        full = (np.abs(effort[at]) >= self._own) & ~saturated[at]
        if full.any():
            for each in counts:
                each[at] += full
