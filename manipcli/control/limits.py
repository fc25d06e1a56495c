"""Joint limits on commands, applied after the controllers: pure functions, and a limiter that counts what it cut."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from manipcli.control.command import JointCommand, Mode
from manipcli.core.geometry import Array
from manipcli.model.robot import JointLimits


def limit_position(
    command: npt.ArrayLike,
    *,
    lower: npt.ArrayLike = -math.inf,
    upper: npt.ArrayLike = math.inf,
    velocity: npt.ArrayLike = math.inf,
    previous: npt.ArrayLike,
    dt: float,
) -> Array:
    """Clamped to [lower, upper] and to previous -+ velocity dt; the position limit wins.

    Args:
        command: (n) rad or m.
        lower, upper, velocity: limits; infinite: none.
        previous: (n) the position command before, or the measured position when there is none.
        dt: [s].
    """
    reach = np.asarray(velocity, dtype=np.float64) * dt
    before = np.asarray(previous, dtype=np.float64)
    near = np.minimum(np.maximum(np.asarray(command, dtype=np.float64), before - reach), before + reach)
    return np.asarray(np.minimum(np.maximum(near, lower), upper))


def limit_velocity(
    command: npt.ArrayLike,
    *,
    velocity: npt.ArrayLike = math.inf,
    dt: float,
    position: npt.ArrayLike | None = None,
    lower: npt.ArrayLike = -math.inf,
    upper: npt.ArrayLike = math.inf,
    acceleration: npt.ArrayLike = math.inf,
    previous: npt.ArrayLike | None = None,
) -> Array:
    """Clamped to -+ velocity, to what reaches no position limit within `dt`, and to previous -+ acceleration dt.

    A joint beyond a limit may only move back: outward commands become 0, inward ones stay.

    Args:
        command: (n) rad/s or m/s.
        velocity, acceleration, lower, upper: limits; infinite: none.
        dt: [s].
        position: (n) measured; None: position limits are not looked at.
        previous: (n) the velocity command before; None: the acceleration is not limited.
    """
    high = np.asarray(velocity, dtype=np.float64)
    low = -high
    if position is not None:
        measured = np.asarray(position, dtype=np.float64)
        high = np.minimum(high, np.maximum((np.asarray(upper, dtype=np.float64) - measured) / dt, 0.0))
        low = np.maximum(low, np.minimum((np.asarray(lower, dtype=np.float64) - measured) / dt, 0.0))
    limited = np.asarray(command, dtype=np.float64)
    if previous is not None:
        change = np.asarray(acceleration, dtype=np.float64) * dt
        before = np.asarray(previous, dtype=np.float64)
        limited = np.minimum(np.maximum(limited, before - change), before + change)
    return np.asarray(np.minimum(np.maximum(limited, low), high))


def limit_effort(
    command: npt.ArrayLike,
    *,
    effort: npt.ArrayLike,
    position: npt.ArrayLike,
    velocity: npt.ArrayLike,
    lower: npt.ArrayLike = -math.inf,
    upper: npt.ArrayLike = math.inf,
    max_velocity: npt.ArrayLike = math.inf,
) -> Array:
    """Clamped to -+ effort, with no push further out at a position limit and none further up beyond the velocity limit.

    At or below `lower` and not moving back (velocity <= 0) the command cannot be negative; above `max_velocity` it
    cannot be positive; and the mirror images.

    Args:
        command: (n) N m or N.
        effort, lower, upper, max_velocity: limits; infinite: none.
        position, velocity: (n) measured.
    """
    q, v = np.asarray(position, dtype=np.float64), np.asarray(velocity, dtype=np.float64)
    q_low, q_high = np.asarray(lower, dtype=np.float64), np.asarray(upper, dtype=np.float64)
    high, fast = np.asarray(effort, dtype=np.float64), np.asarray(max_velocity, dtype=np.float64)
    no_push = ((q >= q_high) & (v >= 0.0)) | (v > fast)
    no_pull = ((q <= q_low) & (v <= 0.0)) | (v < -fast)
    highest = np.where(no_push, 0.0, high)
    lowest = np.where(no_pull, 0.0, -high)
    return np.asarray(np.minimum(np.maximum(np.asarray(command, dtype=np.float64), lowest), highest))


class JointLimiter:
    """The limits of all joints of a robot on their commands, once a tick.

    Attributes:
        saturations: (n) int, in how many ticks each joint's command was cut.
        saturated: (n) bool, in the last tick.

    Args:
        limits: (n) of the joints.
    """

    def __init__(self, limits: Sequence[JointLimits]) -> None:
        n = len(limits)

        def bound(values: list[float | None], default: float) -> Array:
            return np.array([default if value is None else value for value in values], dtype=np.float64)

        self._lower = bound([limit.lower for limit in limits], -math.inf)
        self._upper = bound([limit.upper for limit in limits], math.inf)
        self._velocity = bound([limit.velocity for limit in limits], math.inf)
        self._acceleration = bound([limit.acceleration for limit in limits], math.inf)
        self._effort = bound([limit.effort for limit in limits], math.inf)
        self._version = -1
        self._seen = np.zeros((3, n))
        self._inside, self._below = np.zeros((2, 3, n), dtype=np.bool_)
        self.saturations = np.zeros(n, dtype=np.int64)
        self.saturated = np.zeros(n, dtype=np.bool_)
        self._cut = False
        self._previous = np.full(n, math.nan)

    def reset(self) -> None:
        """Forgets the commands before and the counts."""
        self._previous[:] = math.nan
        self.saturations[:] = 0
        self.saturated[:] = False

    def _obey(self, modes: Sequence[Mode]) -> None:
        self._previous[:] = math.nan
        self._positions = np.flatnonzero([mode == "position" for mode in modes])
        self._velocities = np.flatnonzero([mode == "velocity" for mode in modes])
        self._plain = not len(self._positions) and not len(self._velocities)
        efforts = np.array([mode == "effort" for mode in modes])
        # Infinite: joints without effort command.
        self._watched = [
            np.where(efforts, limit, default)
            for limit, default in (
                (self._lower, -math.inf),
                (self._upper, math.inf),
                (self._velocity, math.inf),
                (self._effort, math.inf),
            )
        ]
        lower, upper, velocity, effort = self._watched
        # Nothing is cut while position, velocity and effort lie within these, and all commands are efforts.
        self._least = np.stack((lower, -velocity, -effort))
        self._most = np.stack((upper, velocity, effort))

    def apply(self, command: JointCommand, position: Array, velocity: Array, dt: float) -> None:
        """Cuts the command in place; `position`, `velocity` (n) are measured, `dt` [s] is a control period."""
        if command.version != self._version:
            self._version = command.version
            self._obey(command.modes)
        seen, inside = self._seen, self._inside
        seen[0], seen[1], seen[2] = position, velocity, command.effort
        np.greater(seen, self._least, out=inside)
        np.less(seen, self._most, out=self._below)
        np.logical_and(inside, self._below, out=inside)
        if self._plain and np.count_nonzero(inside) == inside.size:
            if self._cut:
                self._cut = False
                self.saturated.fill(False)
            return
        self._cut = True
        self.saturated.fill(False)
        lower, upper, speed, effort = self._watched
        limited = limit_effort(
            command.effort,
            effort=effort,
            position=position,
            velocity=velocity,
            lower=lower,
            upper=upper,
            max_velocity=speed,
        )
        np.not_equal(limited, command.effort, out=self.saturated)
        command.effort[:] = limited
        if not self._plain:
            self._apply_others(command, position, dt)
        self.saturations += self.saturated

    def _apply_others(self, command: JointCommand, position: Array, dt: float) -> None:
        i = self._positions
        if len(i):
            before = np.where(np.isnan(self._previous[i]), position[i], self._previous[i])
            limited = limit_position(
                command.position[i],
                lower=self._lower[i],
                upper=self._upper[i],
                velocity=self._velocity[i],
                previous=before,
                dt=dt,
            )
            self.saturated[i] |= limited != command.position[i]
            self._previous[i] = command.position[i] = limited
        i = self._velocities
        if len(i):
            before = np.where(np.isnan(self._previous[i]), command.velocity[i], self._previous[i])
            limited = limit_velocity(
                command.velocity[i],
                velocity=self._velocity[i],
                dt=dt,
                position=position[i],
                lower=self._lower[i],
                upper=self._upper[i],
                acceleration=self._acceleration[i],
                previous=before,
            )
            self.saturated[i] |= limited != command.velocity[i]
            self._previous[i] = command.velocity[i] = limited
