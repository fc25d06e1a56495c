"""Contract of bounds on the timing of a path, besides the limits of single joints: torque, motion of the tool.

A bound has m values per instant, each with the limit 1, of the form

    y = g(q, d) + D(q, v, a) + F(q, v) <= 1

where D is of second order in time: D(q, k v, k^2 a) = k^2 D(q, v, a), g depends on the direction d of the motion only
(gravity, Coulomb friction) and F is linear in the speed (viscous friction). On a path q(s) this is

    D(q, q', q' s''/s'^2 + q'') s'^2 = a s'' + b s'^2

so that TOPP-RA can take it (Pham and Pham 2018, section III). F is bounded by a straight line in s'^2.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.trajectory import JointTrajectory

TOLERANCE = 0.005
"""Relative excess that is accepted, as of velocity and acceleration."""
_SCREENED = 120
_CLEAR = 0.9
_ROUNDING = 1e-9


class Terms(NamedTuple):
    """a s'' + b s'^2 + c <= 0, each (k, m), at k points of a path."""

    a: Array
    b: Array
    c: Array


class TimingBound(ABC):
    """A bound for one motion, with the joints of its path (n).

    Attributes:
        name: of the bounded quantity: the key in task files, or `torque`.
        subject: what is bounded, for reports; a joint's name is not known here.
        limit: the value of the limit; nan where there are several.
    """

    name: str = ""
    subject: str = ""
    limit: float = math.nan

    @abstractmethod
    def still(self, q: Array, direction: Array) -> Array:
        """g (k, m) at positions (k, n), moving slowly along `direction` (k, n)."""

    @abstractmethod
    def moving(self, q: Array, v: Array, a: Array) -> Array:
        """D (k, m)."""

    @abstractmethod
    def text(self, q: Array, v: Array, a: Array) -> str:
        """What exceeds what in one instant, arrays (n): "joint 'a' needs 12 N m; its effort limit is 10 N m"."""

    def viscous(self, v: Array) -> Array | None:
        """F (k, m); None without."""
        return None

    def terms(self, q: Array, first: Array, second: Array) -> Terms:
        """At points of a path (k, n) with its derivatives `first` and `second`; without viscous friction."""
        a = self.moving(q, np.zeros_like(first), first)
        return Terms(a, self.moving(q, first, second), self.still(q, first) - 1.0)

    def values(self, q: Array, v: Array, a: Array) -> Array:
        """y (k, m) of a motion."""
        rub = self.viscous(v)
        total = self.still(q, v) + self.moving(q, v, a)
        return total if rub is None else total + rub

    def used(self, q: Array, v: Array, a: Array) -> Array:
        """(k) the largest used share of the limit of a motion."""
        return np.asarray(self.values(q, v, a).max(axis=1))

    def stretch(self, q: Array, v: Array, a: Array) -> float:
        """The factor by which time must be stretched to keep the bound; 1 or less if it is kept, at least 0.

        From g + D / f^2 + F / f <= 1. Values that are beyond 1 at rest are left out: no timing helps.
        """
        left = 1.0 - self.still(q, v)
        second, first = self.moving(q, v, a), self.viscous(v)
        linear = np.zeros_like(second) if first is None else first
        # left f^2 - F f - D = 0
        root = np.sqrt(np.maximum(linear**2 + 4.0 * left * second, 0.0))
        usable = left > 1e-9
        factor = np.where(usable & ((linear > 0.0) | (second > 0.0)), linear + root, 0.0) / np.where(
            usable, 2 * left, 1
        )
        return float(factor.max(initial=0.0))


def kept(bounds: Sequence[TimingBound], motion: JointTrajectory) -> bool:
    """Whether a motion keeps all bounds; exactly, unless a tenth is left at `_SCREENED` instants."""
    if motion.velocities is None or motion.accelerations is None:
        return True
    q, v, a = motion.positions, motion.velocities, motion.accelerations
    some = np.unique(np.linspace(0, len(q) - 1, _SCREENED).astype(int))
    return all(
        float(bound.values(q[some], v[some], a[some]).max(initial=0.0)) < _CLEAR
        or bound.stretch(q, v, a) <= 1.0 + _ROUNDING
        for bound in bounds
    )


def refuse_exceeded(bounds: Sequence[TimingBound], motion: JointTrajectory) -> None:
    """Check a timed motion at all of its points.

    Raises:
        NotPlannable: names the bound, the amount and the time.
    """
    if motion.velocities is None or motion.accelerations is None:
        return
    q, v, a = motion.positions, motion.velocities, motion.accelerations
    for bound in bounds:
        worst = bound.values(q, v, a).max(axis=1)
        k = int(np.argmax(worst))
        if worst[k] > 1.0 + TOLERANCE:
            raise NotPlannable(f"{bound.text(q[k], v[k], a[k])} at t = {motion.times[k]:.3f} s")


def refuse_at_rest(bounds: Sequence[TimingBound], q: Array, direction: Array) -> None:
    """Check a path (k, n) that has no timing: a bound that is exceeded at rest is the reason.

    Raises:
        NotPlannable: names the bound and the amount.
    """
    for bound in bounds:
        worst = bound.still(q, direction).max(axis=1)
        k = int(np.argmax(worst))
        if worst[k] > 1.0:
            zero = np.zeros_like(q[k])
            raise NotPlannable(f"{bound.text(q[k], zero, zero)} even at rest")
