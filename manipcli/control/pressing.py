"""Pressing: the reference of a spring shifts along an axis until the felt force is the target.

With the felt force p along the axis and the stiffness k of the spring, the shift s obeys

    s' = speed                              before contact,
    s' = 2 pi bandwidth (target - p) / k    in contact; at most `speed` where what is touched may give way.

While the force first rises, s' is also at most v (k + K) / k. K is the stiffness of what is touched, the force over the
distance by which it gave way: a button moves at v at most, and so meets its end stop. There v = `speed` `SHARE`
(1 + `OVER` - p / target): where `speed` is the target times a period over the mass, an impact of one period brings the
force to no more than 1 + `OVER` of the target.

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
from manipcli.core.units import readable
from manipcli.plan.compliance import Pressing

TOUCH: Final = 0.05
"""Share of the target at which contact begins."""
OVER: Final = 0.3
"""Share of the target by which the force may exceed it in an impact."""
SHARE: Final = 0.75
"""Share of the speed that this allows, as an impact in PyBullet is a little longer than a period."""
LEAST: Final = 0.3
"""[N] Least force that counts as contact."""
TOLERANCE: Final = 0.1
"""Share of the target by which the force may differ while it is held, and its mean over a motion."""
DEPTH: Final = 3.0
"""The shift in contact is at most this many times target / stiffness, and the reach: else what is touched gives way."""


class PressingReference:
    """The shift of a reference, and what was felt since it began.

    Args:
        pressing: the force.
        stiffness: along its axis [N/m], above 0.
        shift: to begin with [m].
        contact: the shift at the contact [m], if it is in contact already.

    Attributes:
        shift: s [m].
        contact: s at the last contact [m]; None before any.
        touching: whether it is in contact.
        peak: [N] largest felt force.
        held: [s] for which the force has been within the tolerance.
        steady: [N] mean of the felt force while held.
        mean: [N] mean of the felt force since the first contact.
    """

    def __init__(
        self, pressing: Pressing, stiffness: float, *, shift: float = 0.0, contact: float | None = None
    ) -> None:
        self.pressing = pressing
        self.stiffness = stiffness
        self.shift, self.contact, self.touching = shift, contact, contact is not None
        self.peak = self.held = self.steady = self.mean = 0.0
        self._since = 0.0
        self._met: tuple[float, float] | None = None
        """Tool [m] and force [N] at the first contact; None once the force has reached the target."""
        self._rate = math.tau * pressing.bandwidth / stiffness
        self._began = max(LEAST, TOUCH * pressing.target)

    @property
    def missed(self) -> str:
        """That it met nothing within reach, or that what it touches gives way; "" otherwise."""
        pressing = self.pressing
        if pressing.yields:
            return ""
        if self.contact is None and self.shift >= pressing.reach:
            return f"the tool met nothing within {readable(pressing.reach, 'm')}"
        depth = 0.0 if self.contact is None else self.shift - self.contact
        if depth >= DEPTH * pressing.target / self.stiffness + pressing.reach:
            felt = f"it felt at most {self.peak:.3g} N of {pressing.target:g} N"
            return f"what the tool touches gave way by {readable(round(depth, 3), 'm')}; {felt}"
        return ""

    @property
    def text(self) -> str:
        """`felt 9.98 N in the mean, 10.4 N at most (4 % over)`."""
        mean, target = self.steady if self.held else self.mean, self.pressing.target
        over = max(0.0, 100.0 * (self.peak / target - 1.0))
        return f"felt {mean:.3g} N in the mean, {self.peak:.3g} N at most ({over:.0f} % over)"

    @property
    def unsteady(self) -> str:
        """Why the mean is not the target; "" where it is."""
        target = self.pressing.target
        if self.pressing.yields:
            return ""
        if self.contact is None:
            return f"the tool touched nothing: it felt at most {self.peak:.3g} N of {target:g} N"
        if abs(self.mean - target) <= TOLERANCE * target:
            return ""
        return f"the tool pressed with {self.mean:.3g} N in the mean; expected {target:g} N within 10 %"

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
        if touching and self.contact is None:
            self.contact, self._met = self.shift, (self.shift - stretch, felt)
        if self.touching and not touching:
            self.shift -= max(0.0, stretch)
        self.touching = touching
        error = pressing.target - felt
        step = self._rate * error if touching else pressing.speed
        if pressing.yields:
            step = min(step, pressing.speed)
        elif self._met is not None and (given := self.shift - stretch - self._met[0]) >= 0.0:
            body = max(0.0, felt - self._met[1]) / given if given else 0.0
            most = pressing.speed * SHARE * max(0.0, 1.0 + OVER - felt / pressing.target)
            step = min(step, most * (1.0 + body / self.stiffness))
        if step < 0.0 or not self.missed:
            self.shift += step * period
        if self.contact is not None:
            self._since += period
            self.mean += (felt - self.mean) * period / self._since
        if abs(error) <= TOLERANCE * pressing.target:
            self._met = None
            self.held += period
            self.steady += (felt - self.steady) * period / self.held
        else:
            self.held = self.steady = 0.0
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
