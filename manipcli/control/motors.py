"""The engine's own motors, of joints that are commanded by position or velocity: how often they gave all they may."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.control.actuation import motor_effort_limits
from manipcli.control.command import Mode
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel

ALL: Final = 1.0 - 1e-6
"""Share of its limit from which on a motor gives all; engines hold the limit as an impulse of a step, and round."""


class MotorLimits:
    """Looks at measured efforts for motors at their limits.

    Args:
        robot: the robot.
        pressing: joints that stand at their limits by intent: those of hands, which press on what they hold.

    Attributes:
        watches: whether there is anything to look at; without, `count` need not be called.
    """

    def __init__(self, robot: RobotModel, *, pressing: Collection[str] = ()) -> None:
        self._limits = ALL * motor_effort_limits(robot)
        self._may = np.array([name not in pressing for name in robot.joint_names]) & np.isfinite(self._limits)
        self._at: npt.NDArray[np.intp] = np.zeros(0, dtype=np.intp)
        self._own = self._limits[self._at]
        self.watches = False

    def select(self, modes: Sequence[Mode]) -> None:
        """From now on each joint (n) obeys this."""
        driven = np.array([mode in ("position", "velocity") for mode in modes], dtype=np.bool_)
        self._at = np.flatnonzero(driven & self._may)
        self._own = self._limits[self._at]
        self.watches = len(self._at) > 0

    def count(self, effort: Array, cut: npt.NDArray[np.bool_], *counts: npt.NDArray[np.int64]) -> None:
        """Adds 1 to each of the `counts` (n) of joints whose motor gave all in the last tick.

        Args:
            effort: (n) measured [N m or N].
            cut: (n) of whom the command of that tick was cut, which is counted already.
            counts: (n), changed in place.
        """
        at = self._at
        full = (np.abs(effort[at]) >= self._own) & ~cut[at]
        if full.any():
            for each in counts:
                each[at] += full
