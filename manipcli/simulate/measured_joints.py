"""What controllers get as the measured joints, where sensors measure some of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.model.state import WorldState


class MeasuredJoints:
    """Joint vectors (n): the readings of sensors where there are any, else the truth.

    Attributes:
        position, velocity, effort: (n); always the same arrays.
        known: whether there was a tick.
    """

    def __init__(self, joints: int) -> None:
        self._block = np.zeros(3 * joints)
        self.position, self.velocity, self.effort = self._block.reshape(3, joints)
        self._unsensed: npt.NDArray[np.intp] = np.arange(joints)
        self.known = False
        self._sensors: list[tuple[slice | npt.NDArray[np.intp], Array]] = []

    def add(self, joints: Sequence[int], reading: Array) -> None:
        """Take these joints from a reading (3 k): their positions, velocities, then efforts."""
        n = len(self.position)
        index = np.array(joints, dtype=np.intp)
        every = np.concatenate((index, index + n, index + 2 * n))
        whole = len(every) == 3 * n and bool((every == np.arange(3 * n)).all())
        self._sensors.append((slice(0, 3 * n) if whole else every, reading))
        self._unsensed = np.setdiff1d(self._unsensed, index)

    def update(self, state: WorldState) -> None:
        """At every tick, after the readings."""
        self.known = True
        if len(self._unsensed):
            at = self._unsensed
            self.position[at], self.velocity[at], self.effort[at] = (
                state.position[at],
                state.velocity[at],
                state.effort[at],
            )
        for index, reading in self._sensors:
            self._block[index] = reading
