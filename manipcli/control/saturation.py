"""Whether commands have to be cut, and of which joints they were, by which limits."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array

KINDS: Final = ("position", "velocity", "effort", "acceleration", "soft_limit")
"""Of limits, as the rows of `JointLimiter.by_kind`."""
POSITION, VELOCITY, EFFORT, ACCELERATION, SOFT = range(len(KINDS))
_MOST = sys.float_info.max  # infinity is beyond it, so that it is found


class Window:
    """Rows of numbers, and whether each lies strictly between its bounds: in two comparisons, not two a row."""

    __slots__ = ("_above", "_all", "_below", "_flags", "_least", "_most", "_values", "rows")

    def __init__(self, least: Sequence[Array], most: Sequence[Array]) -> None:
        self._least = np.maximum(np.concatenate(least), -_MOST)
        self._most = np.minimum(np.concatenate(most), _MOST)
        size = len(self._least)
        self._values = np.zeros(size)
        self.rows = tuple(self._values.reshape(len(least), -1))
        self._flags = np.zeros(2 * size, dtype=np.bool_)
        self._above, self._below = self._flags[:size], self._flags[size:]
        self._all = b"\x01" * (2 * size)

    def holds(self) -> bool:
        np.greater(self._values, self._least, self._above)
        np.less(self._values, self._most, self._below)
        return self._flags.tobytes() == self._all  # faster than asking numpy whether all are true

    def broken(self) -> npt.NDArray[np.bool_]:
        """(rows, joints) which are not, when `holds` was last asked."""
        return ~(self._above & self._below).reshape(len(self.rows), -1)


Rows = tuple[slice, slice] | tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]


def rows_of(kinds: Sequence[int], where: npt.NDArray[np.intp]) -> Rows:
    """The `rows` of `Saturation.add`: these kinds of limits, of the joints `where`."""
    return np.array(kinds)[:, np.newaxis], where


class Saturation:
    """Which joints are cut in a tick, and by what."""

    __slots__ = ("any", "joints", "kinds")

    def __init__(self, n: int) -> None:
        self.joints = np.zeros(n, dtype=np.bool_)
        self.kinds = np.zeros((len(KINDS), n), dtype=np.bool_)
        self.any = False

    def clear(self) -> None:
        self.joints[:], self.kinds[:], self.any = False, False, False

    def add(self, rows: Rows, cut: npt.NDArray[np.bool_], broken: npt.NDArray[np.bool_]) -> None:
        """More joints.

        Args:
            rows: which of `kinds`, and which joints.
            cut: (joints) whether it was.
            broken: (rows, joints) whether the command was beyond that kind of limit; where it was beyond none, a soft
                limit has cut it.
        """
        self.any = True
        where = rows[1]
        self.joints[where] |= cut
        known = broken & cut
        self.kinds[rows] |= known
        self.kinds[SOFT, where] |= cut & ~known.any(axis=0)
