"""Pressing: the reference of a spring shifts along an axis until the felt force is the target.

With the felt force p along the axis and the stiffness k of the spring, the shift s obeys

    s' = speed                              before contact, from the speed that it has to there,
    s' = 2 pi bandwidth (target - p) / k    in contact.

In contact with something stiff p' = k s', so that p tends to the target as exp(-2 pi bandwidth t) and never exceeds it.
Contact begins above `TOUCH` of the target, at least `LEAST` [N], and is lost below half of that: the reference then
advances at `speed` again, from where the spring is relaxed, so that nothing is wound up. Integral control of the force
error: Siciliano and Villani, Robot Force Control (1999), chapter 3.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.plan.compliance import Pressing

TOUCH: Final = 0.1
"""Share of the target at which contact begins."""
LEAST: Final = 0.3
"""[N] Least force that counts as contact."""
TOLERANCE: Final = 0.1
"""Share of the target by which the force may differ while it is held."""
DEPTH: Final = 3.0
"""The shift in contact is at most this many times target / stiffness: more means that what is touched gives way."""


class PressingReference:
    """The shift of a reference, and what was felt since it began.

    Args:
        pressing: the force.
        stiffness: along its axis [N/m], above 0.
        shift: to begin with [m].

    Attributes:
        shift: s [m].
        contact: s at the last contact [m]; None before any.
        touching: whether it is in contact.
        peak: [N] largest felt force.
        held: [s] for which the force has been within the tolerance.
        mean: [N] of the felt force while held.
    """

    def __init__(self, pressing: Pressing, stiffness: float, *, shift: float = 0.0) -> None:
        self.pressing = pressing
        self.stiffness = stiffness
        self.shift = shift
        self.contact: float | None = None
        self.touching = False
        self.peak = self.held = self.mean = 0.0
        self._rate = math.tau * pressing.bandwidth / stiffness
        self._began = max(LEAST, TOUCH * pressing.target)

    @property
    def missed(self) -> bool:
        """Whether it met nothing within reach, or what it touches gives way."""
        if self.contact is None or not self.touching:
            return self.shift >= self.pressing.reach
        return self.shift - self.contact > DEPTH * self.pressing.target / self.stiffness + self.pressing.reach

    def update(self, period: float, felt: float, stretch: float) -> float:
        """The shift [m] after one update of the length `period` [s].

        Args:
            period: of the update.
            felt: force along the axis [N].
            stretch: of the spring along the axis [m], given up where contact is lost.
        """
        pressing = self.pressing
        self.peak = max(self.peak, felt)
        touching = felt >= (0.5 * self._began if self.touching else self._began)
        if touching and not self.touching:
            self.contact = self.shift
        if self.touching and not touching:
            self.shift -= max(0.0, stretch)
        self.touching = touching
        error = pressing.target - felt
        step = self._rate * error if touching else pressing.speed
        if not self.missed or step < 0.0:
            self.shift += step * period
        if abs(error) <= TOLERANCE * pressing.target:
            self.mean += (felt - self.mean) * period / (self.held + period)
            self.held += period
        else:
            self.held = self.mean = 0.0
        return self.shift


class Relaxing:
    """A shift that is given up smoothly within `duration` [s], from `shift` (3,) [m]."""

    def __init__(self, shift: Array, duration: float = 0.3) -> None:
        self._shift, self._duration, self._time = shift, duration, 0.0

    def update(self, period: float) -> Array:
        """(3,) after one update of the length `period` [s]."""
        self._time = min(self._duration, self._time + period)
        u = self._time / self._duration
        return np.asarray(self._shift * (1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u * u)))
