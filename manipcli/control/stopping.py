"""How a trajectory controller comes to rest: from a reference in motion, within the limits of its joints.

Without `compat` the stop is planned from position, velocity and acceleration of the reference, by a `StopPlanner`: it
keeps the acceleration and jerk limits. Otherwise each joint has a constant deceleration, as in ROS 2, or all stop
within a stated duration, as in ROS 1. No stop leaves the position limits: near them a joint stops by itself, and at
last with a larger deceleration.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from manipcli.control.active_trajectory import (
    ACCELERATION,
    EFFORT,
    INSTANT,
    POSITION,
    VELOCITY,
    ActiveTrajectory,
    Columns,
    Part,
)
from manipcli.control.trajectory_goal import POSITION_SLACK, JointFacts
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.trajectory import JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec


class StopPlanner(Protocol):
    """Plans the quickest stop from a state of motion."""

    def __call__(
        self,
        names: Sequence[str],
        state: tuple[Array, Array, Array],
        *,
        acceleration: Array,
        jerk: Array,
        period: float,
        together: bool,
    ) -> JointTrajectory:
        """One point per period [s], the first in the state, the last at rest.

        Args:
            names: (n) joints.
            state: position, velocity and acceleration (n).
            acceleration, jerk: (n) limits; a jerk may be infinite.
            period: [s]
            together: whether all joints stop at the same time, on their straight path if they are on one.

        Raises:
            NotPlannable: there is none.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Stopping:
    """Settings of one controller.

    Attributes:
        facts: the joints and their limits.
        duration: [s] of a stop; 0: by deceleration.
        deceleration: (n) of each joint; infinite: it stops at once.
        together: whether all joints stop at the same time, on their straight path, if their limits allow it.
        planner: None: constant deceleration.
    """

    facts: JointFacts
    duration: float
    deceleration: Array
    together: bool
    planner: StopPlanner | None = None

    @staticmethod
    def of(
        facts: JointFacts, constraints: ConstraintsSpec, duration: float, planner: StopPlanner | None = None
    ) -> Stopping:
        """As the constraints state: at once, or with the acceleration limits unless joints have their own."""
        if not constraints.decelerate_on_cancel:
            return Stopping(facts, duration, np.full(len(facts.joints), np.inf), True)
        own = {joint: constraint.max_deceleration_on_cancel for joint, constraint in constraints.joints.items()}
        chosen = [own.get(joint, 0.0) or limit for joint, limit in zip(facts.joints, facts.acceleration, strict=True)]
        return Stopping(facts, duration, np.array(chosen), not any(own.values()), planner)

    def to_rest(self, row: Array, period: float) -> ActiveTrajectory:
        """The active trajectory from `row` (4, n) until it rests, in seconds of real time; ticks of `period` [s].

        If that exceeds a position limit of a joint, each joint stops by itself: within the time given by its own
        deceleration, or by the stop duration, but before its limit, even with a larger deceleration.
        """
        if self.planner is not None and self.duration == 0.0:
            return self._planned(self.planner, row, period)
        if self.duration > 0.0:
            own = np.full(row.shape[1], self.duration)
            active = stopping_in(row, self.duration)
        else:
            own = np.abs(row[VELOCITY]) / self.deceleration
            common = np.where(np.isfinite(self.deceleration), own.max(), 0.0)
            active = decelerating(row, common if self.together else own)
        if self._inside(active.sample(np.array([active.end]))[:, POSITION], row[POSITION]).all():
            return active
        return decelerating(row, self._alone(row))

    def _planned(self, planner: StopPlanner, row: Array, period: float) -> ActiveTrajectory:
        """All joints together; else each by itself, and those that leave their limits so with a larger deceleration."""
        moves = row[VELOCITY : ACCELERATION + 1].any(axis=0)
        columns = np.flatnonzero(moves & np.isfinite(self.deceleration))
        if not len(columns):
            return ActiveTrajectory.hold(row[POSITION], row[EFFORT])
        names = tuple(self.facts.joints[k] for k in columns)
        q, v, a = row[:EFFORT, columns]
        acceleration, jerk = self.deceleration[columns], self.facts.jerk[columns]
        beyond = columns
        for together in (True, False) if self.together else (False,):
            with suppress(NotPlannable):
                stop = planner(names, (q, v, a), acceleration=acceleration, jerk=jerk, period=period, together=together)
                inside = self._inside(stop.positions, row[POSITION], columns)
                if inside.all() or not together:
                    beyond, columns = columns[~inside], columns[inside]
                    break
        else:
            return decelerating(row, self._alone(row))
        times = np.zeros(row.shape[1])
        times[beyond] = self._alone(row)[beyond]
        active = decelerating(row, times)
        return active.with_part(_following(columns, stop, inside, row[EFFORT])) if len(columns) else active

    def _alone(self, row: Array) -> Array:
        """(n) [s] of the constant deceleration of each joint by itself, before its position limit."""
        rate = np.abs(row[VELOCITY])
        ahead = np.where(row[VELOCITY] > 0.0, self.facts.upper - row[POSITION], row[POSITION] - self.facts.lower)
        room = np.maximum(ahead, 0.0)  # 0 beyond the limit
        latest = np.divide(2.0 * room, rate, out=np.zeros_like(rate), where=rate > 0.0)
        own = np.full_like(rate, self.duration) if self.duration > 0.0 else rate / self.deceleration
        return np.asarray(np.minimum(own, latest))

    def _inside(self, positions: Array, begin: Array, columns: Columns = slice(None)) -> npt.NDArray[np.bool_]:
        """(m) whether `positions` (k, m) are within the limits; from `begin` (n) beyond them, go no further."""
        lower, upper = np.minimum(self.facts.lower, begin), np.maximum(self.facts.upper, begin)
        within = (positions >= lower[columns] - POSITION_SLACK) & (positions <= upper[columns] + POSITION_SLACK)
        return np.asarray(within.all(axis=0))


def decelerating(row: Array, times: Array) -> ActiveTrajectory:
    """From a moving `row` (4, n) to rest, at constant deceleration: q = q0 + v0 (t - t^2 / (2 T)), v = v0 (1 - t / T).

    It ends at q0 + v0 T / 2.

    Args:
        row: the reference now.
        times: (n) T [s] of each joint; 0 stops it at once.
    """
    velocity = row[VELOCITY]
    active = ActiveTrajectory.hold(row[POSITION], row[EFFORT])
    for time in np.unique(times[times > INSTANT]):
        columns = np.flatnonzero(times == time)
        begin, rate = row[POSITION, columns], velocity[columns]
        active = active.with_part(
            _part(columns, float(time), (begin, begin + 0.5 * rate * time), (rate, 0.0 * rate), None, row[EFFORT])
        )
    return active


def stopping_in(row: Array, duration: float) -> ActiveTrajectory:
    """From a moving `row` (4, n) to rest in `duration` T [s], as ROS 1 stops.

    The curve is the first half of the quintic that reverses the joint within 2 T, from (q0, v0, 0) to (q0, -v0, 0): it
    ends at q0 + 5/8 v0 T.
    """
    n = row.shape[1]
    position, velocity, still = row[POSITION], row[VELOCITY], np.zeros(n)
    round_trip = JointTrajectory.of_arrays(
        [str(k) for k in range(n)], [0.0, 2.0 * duration], [position, position], [velocity, -velocity], [still, still]
    )
    middle, _, bend = round_trip.sample(duration)
    part = _part(np.arange(n), duration, (position, middle), (velocity, still), (still, bend), row[EFFORT])
    return ActiveTrajectory.hold(position, row[EFFORT]).with_part(part)


def _part(
    columns: npt.NDArray[np.intp],
    duration: float,
    positions: Sequence[Array],
    velocities: Sequence[Array],
    accelerations: Sequence[Array] | None,
    effort: Array,
) -> Part:
    """A part of two points, with a constant effort."""
    names = [str(k) for k in columns]
    efforts = np.tile(effort[columns], (2, 1))
    return Part(
        columns,
        JointTrajectory.of_arrays(
            names, [0.0, duration], np.array(positions), np.array(velocities), accelerations, efforts
        ),
        0.0,
    )


def _following(
    columns: npt.NDArray[np.intp], stop: JointTrajectory, chosen: npt.NDArray[np.bool_], effort: Array
) -> Part:
    """A part with the `chosen` joints of a stop, and a constant effort."""
    assert stop.velocities is not None and stop.accelerations is not None
    return Part(
        columns,
        JointTrajectory.of_arrays(
            [name for name, taken in zip(stop.names, chosen, strict=True) if taken], stop.times,
            stop.positions[:, chosen], stop.velocities[:, chosen], stop.accelerations[:, chosen],
            np.tile(effort[columns], (len(stop.times), 1)),
        ),
        0.0,
    )  # fmt: skip
