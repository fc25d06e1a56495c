"""Jogging: the reference of joints that follow a velocity, which may change at every tick, within their limits.

From the state (q, v) at a tick, the velocity v' of the next tick is chosen; in between the acceleration is constant:

    q' = q + (v + v') dt / 2

The wanted velocity u is slowed down along its direction so that no joint has to leave that direction to stop before its
position limit, and v' = v + s (u - v) with the largest s <= 1 that keeps the acceleration limits: a motion starts and
ends on a straight line of joint velocities. At last each joint is bounded by itself. It can stop before its limit with
its acceleration a from every state that these bounds allow, since after v' it needs at most

    v' dt / 2 + v'^2 / (2 a) + a dt^2 / 8,   of which a dt^2 / 8 is for a last tick that is not needed as a whole.

So limits of position, velocity and acceleration hold at every tick, for any sequence of wanted velocities. A reference
that was in motion before and cannot stop in time with its acceleration limit stops with a larger one. Jerk is not
limited. Nothing here knows of collisions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Protocol

import numpy as np

from manipcli.control.active_trajectory import ACCELERATION, EFFORT, POSITION, VELOCITY, ActiveTrajectory, Reference
from manipcli.control.trajectory_goal import JointFacts
from manipcli.core.geometry import Array
from manipcli.description.elements import JointLimits

SHARE: Final = 0.05
"""Least share of its acceleration limit with which a joint is expected to brake along the wanted direction."""
UNLIMITED: Final = 1e3
"""[rad/s2 or m/s2] Acceleration of a joint without a limit."""
LEAST_ROOM: Final = 1e-12
"""[rad or m] A smaller distance to a limit is none."""


class Wish(Protocol):
    """Wanted velocities at one configuration.

    Attributes:
        velocity: (n) if there were no limits [rad/s or m/s].
    """

    @property
    def velocity(self) -> Array: ...

    def within(self, lower: Array, upper: Array) -> Array:
        """(n) those that are wanted with these bounds (n), which contain 0."""
        ...


class JogTarget(Protocol):
    """What a jogged controller is asked for."""

    def wish(self, q: Array) -> Wish:
        """The wanted velocities at the positions `q` (n) of its joints."""
        ...


class JogLaw:
    """The law of the module for n joints.

    Args:
        facts: of the joints.
        lower, upper: (n) position limits.
    """

    def __init__(self, facts: JointFacts, lower: Array, upper: Array) -> None:
        self._lower, self._upper = lower, upper
        self._fastest = facts.velocity
        self._acceleration = np.minimum(facts.acceleration, UNLIMITED)

    def step(self, q: Array, v: Array, target: JogTarget | None, dt: float, scale: float = 1.0) -> tuple[Array, Array]:
        """Position and velocity (n) of the next tick.

        Args:
            q, v: (n) now.
            target: None: stop.
            dt: [s] to the next tick.
            scale: of the wanted velocities, 0 to 1.
        """
        a = self._acceleration
        change = self._wanted(q, v, target, dt, scale) - v
        size = np.abs(change)
        share = np.divide(a * dt, size, out=np.ones_like(size), where=size > 0.0)
        lower, upper = self._bounds(q, v, a, dt)
        lower, upper = (np.clip(bound, v - a * dt, v + a * dt) for bound in (lower, upper))
        upper = np.minimum(upper, _in_time(self._upper - q, v, a, dt))
        lower = np.maximum(lower, -_in_time(q - self._lower, -v, a, dt))
        after = np.clip(v + min(1.0, float(share.min())) * change, np.minimum(lower, upper), upper)
        reached = q + (v + after) * (0.5 * dt)
        return np.clip(reached, np.minimum(self._lower, q), np.maximum(self._upper, q)), after

    def _wanted(self, q: Array, v: Array, target: JogTarget | None, dt: float, scale: float) -> Array:
        """u (n), from which all joints can stop along it."""
        if target is None or scale == 0.0:
            return np.zeros_like(v)
        wish = target.wish(q + v * dt)
        speed = np.abs(wish.velocity)
        if not speed.any():
            return np.zeros_like(v)
        a = self._acceleration
        common = float(np.divide(a, speed, out=np.full_like(a, math.inf), where=speed > 0.0).min())
        lower, upper = self._bounds(q, v, np.clip(common * speed, SHARE * a, a), dt)
        return scale * wish.within(lower, upper)

    def _bounds(self, q: Array, v: Array, a: Array, dt: float) -> tuple[Array, Array]:
        """(n), (n) least and largest velocity of the next tick from which the limits can be kept; they contain 0."""
        upper = np.minimum(_stoppable(self._upper - q, v, a, dt), self._fastest)
        return -np.minimum(_stoppable(q - self._lower, -v, a, dt), self._fastest), upper


def _stoppable(room: Array, v: Array, a: Array, dt: float) -> Array:
    """(n) largest v' from which a joint with this room ahead stops in time; see the module."""
    left = room - v * (0.5 * dt) - a * (dt * dt / 8.0)
    return np.maximum(a * (np.sqrt(np.maximum(0.25 * dt * dt + 2.0 * left / a, 0.0)) - 0.5 * dt), 0.0)


def _in_time(room: Array, v: Array, a: Array, dt: float) -> Array:
    """(n) v' of joints that can only stop with a deceleration above `a`; infinite for all others."""
    needed = v * v / (2.0 * np.maximum(room, LEAST_ROOM))
    late = (v > 0.0) & (needed > a * (1.0 + 1e-6))
    return np.where(late, np.maximum(v - needed * dt, 0.0), math.inf)


class Jogging:
    """Jogs the reference of one controller, from its first step until it is at rest after the end of its target.

    Args:
        facts: of the joints.
        limits: (n) of the joints, with soft limits; None: those of `facts`.

    Attributes:
        active: whether there is a target, or a motion that is not at rest yet.
    """

    def __init__(self, facts: JointFacts, limits: Sequence[JointLimits] | None) -> None:
        lower, upper = facts.lower, facts.upper
        if limits is not None:
            lower, upper = np.array([limit.within_soft for limit in limits], dtype=np.float64).T
        self._law = JogLaw(facts, lower, upper)
        self.active = False
        self._target: JogTarget | None = None
        self._until = 0.0
        self._next: Array | None = None

    def begin(self, target: JogTarget, until: float) -> None:
        """Follow `target` from the next tick on, until the simulated time `until` [s]; then stop."""
        self.active, self._target, self._until = True, target, until

    def end(self) -> Array | None:
        """End at once; returns the reference (4, n) of this tick, None if there was no step."""
        row, self._next = self._next, None
        self.active, self._target = False, None
        return row

    def step(self, reference: Reference, time: float, period: float, scale: float) -> None:
        """Write the reference of the tick at `time`, and what is fed forward to the next.

        Args:
            reference: of the controller; before the first step it may be in motion.
            time: [s] now.
            period: [s] to the next tick.
            scale: of the wanted velocities, 0 to 1.
        """
        row = self._next
        if row is None:
            row = reference.row(time)
            row[EFFORT] = 0.0
        target = self._target if time < self._until - 1e-9 else None
        if target is None and not row[VELOCITY].any():
            self.end()
            reference.hold(ActiveTrajectory.hold(row[POSITION]), time=time)
            return
        ahead = self._next = row.copy()
        ahead[POSITION], ahead[VELOCITY] = self._law.step(row[POSITION], row[VELOCITY], target, period, scale)
        row[ACCELERATION] = ahead[ACCELERATION] = (ahead[VELOCITY] - row[VELOCITY]) / period
        reference.hold(ActiveTrajectory(row), time=time, ahead=ahead)
