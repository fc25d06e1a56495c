"""Clock of a trajectory: its time s as a function of simulated time, at a speed ds/dt that may change smoothly."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from manipcli.core.geometry import Array

RATE: Final = 4.0
"""[1/s] Largest rate of the speed."""
SLEW: Final = 40.0
"""[1/s2] Largest change of the rate towards the wanted speed: from nominal to rest in at least 0.35 s."""
ON_KNOT: Final = 1e-3
"""A time within this tolerance, in periods, of a knot counts as that knot."""


class TrajectoryClock:
    """Runs at a constant speed f, or changes it along the path q(s) of the trajectory.

    While it changes, f is linear between knots one control period apart. Its rate is at most `RATE` and changes by
    `SLEW`; at each knot, for each joint with an acceleration limit a,

        |q'' f^2 + q' rate| <= max(a, |q''| f^2)

    The left side is the acceleration of the joint. So a change of speed exceeds no limit that the trajectory keeps, the
    joints stay on the path, and speed 0 is rest on it. Where the trajectory itself brakes at a limit, it cannot brake
    more: the change waits. Limits of jerk are not considered.

    Args:
        time: [s] at which s is 0.
        speed: f, 0 or more.
    """

    __slots__ = ("_begin", "_limits", "_path", "_period", "_rates", "_s", "_speeds", "_wanted")

    def __init__(self, time: float, speed: float = 1.0) -> None:
        self._steady(time, 0.0, speed)

    def _steady(self, time: float, s: float, speed: float) -> None:
        self._begin, self._period = time, 1.0
        self._s, self._speeds, self._rates = [s], [speed], [0.0]
        self._wanted = speed

    def now(self, time: float) -> tuple[float, float, float]:
        """s [s], its speed, and the rate of that [1/s] at `time` [s]."""
        k = 0
        if len(self._s) > 1 or self._rates[0]:
            k = max(0, int((time - self._begin) / self._period + ON_KNOT))
            self._extend(k)
            k = min(k, len(self._s) - 1)
        s, speed, rate = self._s[k], self._speeds[k], self._rates[k]
        local = time - (self._begin + k * self._period if k else self._begin)
        if rate == 0.0:
            return s + local * speed, speed, 0.0
        return s + local * (speed + 0.5 * rate * local), speed + rate * local, rate

    def is_steady(self, time: float) -> bool:
        """Whether it has the wanted speed at `time` [s]."""
        return self.now(time)[1:] == (self._wanted, 0.0)

    def ahead(self, time: float, period: float, count: int) -> tuple[Array, Array, Array]:
        """As `now`, arrays (count) at `time` and the following multiples of `period` [s]."""
        steps = np.arange(count, dtype=np.float64)
        if self.is_steady(time):
            s, speed, _ = self.now(time)
            return s + speed * period * steps, np.full(count, speed), np.zeros(count)
        rows = np.array([self.now(time + k * period) for k in steps.tolist()])
        return rows[:, 0], rows[:, 1], rows[:, 2]

    def jump(self, speed: float, time: float) -> None:
        """Run at this speed from `time` [s] on."""
        self._steady(time, self.now(time)[0], speed)

    def change(self, speed: float, time: float, period: float, path: Callable[[float], Array], limits: Array) -> None:
        """Change to this speed from `time` on.

        Args:
            speed: 0 or more.
            time: [s].
            period: [s] of the control ticks.
            path: s [s] -> rows of position, velocity, acceleration (n) on the trajectory.
            limits: (n) of accelerations; infinite without a limit.
        """
        s, present, rate = self.now(time)
        self._begin, self._period, self._wanted = time, period, speed
        self._path, self._limits = path, limits
        self._s, self._speeds, self._rates = [s], [present], [self._rate(s, present, rate)]

    def _extend(self, last: int) -> None:
        """Knots up to this one, or until the wanted speed."""
        while len(self._s) <= last and (self._speeds[-1] != self._wanted or self._rates[-1] != 0.0):
            self._add()

    def _add(self) -> None:
        s, speed, rate, h = self._s[-1], self._speeds[-1], self._rates[-1], self._period
        reached = max(0.0, speed + rate * h)
        if abs(reached - self._wanted) < 1e-12:
            reached = self._wanted
        self._s.append(s + h * (speed + 0.5 * rate * h))
        self._speeds.append(reached)
        self._rates.append(self._rate(self._s[-1], reached, rate))

    def _rate(self, s: float, speed: float, before: float) -> float:
        """The rate from a knot on, after the rate `before`; see the class."""
        change, h = self._wanted - speed, self._period
        slew = SLEW * h
        if abs(change) <= slew * h and abs(before) <= 2.0 * slew:
            return change / h
        sign = math.copysign(1.0, change)
        towards = sign * before
        # From here on steps of `slew` end at the wanted speed: |change| = h (r + (r - slew) + ...).
        last = math.sqrt(slew**2 / 4.0 + 2.0 * SLEW * abs(change)) - slew / 2.0
        best = min(RATE, last, towards + slew)
        rate = sign * max(best, towards - slew)
        return math.copysign(min(abs(rate), self._room(s, speed, rate)), rate)

    def _room(self, s: float, speed: float, rate: float) -> float:
        """The largest rate in the direction of `rate` that keeps the acceleration limits."""
        _, velocity, acceleration = self._path(s)[:3]
        moves = velocity != 0.0
        along = acceleration[moves] * speed**2 * np.sign(velocity[moves] * rate)
        room = (np.maximum(self._limits[moves], np.abs(along)) - along) / np.abs(velocity[moves])
        return float(room.min(initial=np.inf))
