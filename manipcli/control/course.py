"""What a trajectory controller follows: for each joint the trajectory that began last, in one clock."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.plan.trajectory import JointTrajectory

POSITION, VELOCITY, ACCELERATION, EFFORT = 0, 1, 2, 3
"""The rows of a sample (4, n): a reference, and the effort to add to the command."""

INSTANT = 1e-9
"""Times nearer than this [s] are the same: ticks are rounded."""

Columns = slice | npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A trajectory of the joints at `columns`, from `begin` [s] of the course on; its joints rest at its end."""

    columns: Columns
    trajectory: JointTrajectory
    begin: float

    @property
    def end(self) -> float:
        return self.begin + self.trajectory.duration


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """`rest` (4, n) holds for each joint until a part has it; a later part takes joints over from an earlier one."""

    rest: Array
    parts: tuple[Part, ...] = ()

    @staticmethod
    def hold(position: Array, effort: Array | float = 0.0) -> Course:
        """At rest."""
        rest = np.zeros((4, len(position)))
        rest[POSITION], rest[EFFORT] = position, effort
        return Course(rest)

    @property
    def end(self) -> float:
        """[s] from when on all rests."""
        ends = np.zeros(self.rest.shape[1])
        for part in self.parts:
            ends[part.columns] = part.end
        return float(ends.max())

    def sample(self, times: Array) -> Array:
        """(T, 4, n) at ascending `times` (T) [s] of the course."""
        rows = np.empty((len(times), *self.rest.shape))
        rows[:] = self.rest
        for part in self.parts:
            first = int(np.searchsorted(times, part.begin - INSTANT))
            local = np.maximum(times[first:] - part.begin, 0.0)
            trajectory = part.trajectory
            count = int(np.searchsorted(local, trajectory.duration + INSTANT, side="right"))
            running = np.minimum(local[:count], trajectory.duration)
            own = rows[first : first + count]
            own[:, POSITION, part.columns], own[:, VELOCITY, part.columns], own[:, ACCELERATION, part.columns] = (
                trajectory.sample(running)
            )
            over = rows[first + count :]
            over[:, :, part.columns] = 0.0
            over[:, POSITION, part.columns] = trajectory.positions[-1]
            if trajectory.efforts is not None:
                own[:, EFFORT, part.columns] = trajectory.sample_effort(running)
                over[:, EFFORT, part.columns] = trajectory.efforts[-1]
            else:
                own[:, EFFORT, part.columns] = 0.0
        return rows

    def ticks(self, period: float) -> Array:
        """(T, 4, n) at 0, `period`, ... up to the first two ticks that are not before the end: the last is at rest."""
        count = math.ceil(self.end / period - 1e-6)
        return self.sample(np.arange(count + 2, dtype=np.float64) * period)

    def from_time(self, now: float) -> Course:
        """The same, with `now` as its time 0."""
        if self.end <= now:
            return Course(self.sample(np.array([now]))[0])
        return Course(self.rest, tuple(Part(part.columns, part.trajectory, part.begin - now) for part in self.parts))

    def with_part(self, part: Part) -> Course:
        """With one that takes its joints over; parts that have no joint left are forgotten."""
        kept: list[Part] = []
        taken = np.zeros(self.rest.shape[1], dtype=np.bool_)
        for one in (part, *reversed(self.parts)):
            if not taken[one.columns].all():
                kept.insert(0, one)
            if one.begin <= INSTANT:
                taken[one.columns] = True
        return Course(self.rest, tuple(kept))


def decelerating(row: Array, times: Array) -> Course:
    """From a moving `row` (4, n) to rest, at constant deceleration: q = q0 + v0 (t - t^2 / (2 T)), v = v0 (1 - t / T).

    It ends at q0 + v0 T / 2.

    Args:
        row: what is followed now.
        times: (n) T [s] of each joint; 0: it stops at once.
    """
    velocity = row[VELOCITY]
    course = Course.hold(row[POSITION], row[EFFORT])
    for time in np.unique(times[times > INSTANT]):
        columns = np.flatnonzero(times == time)
        begin, rate = row[POSITION, columns], velocity[columns]
        course = course.with_part(
            _part(columns, float(time), (begin, begin + 0.5 * rate * time), (rate, 0.0 * rate), None, row[EFFORT])
        )
    return course


def stopping_in(row: Array, duration: float) -> Course:
    """From a moving `row` (4, n) to rest in `duration` T [s], as ROS 1 stops.

    The curve is the first half of the quintic that turns the joint round within 2 T, from (q0, v0, 0) to (q0, -v0, 0):
    it ends at q0 + 5/8 v0 T.
    """
    n = row.shape[1]
    position, velocity, still = row[POSITION], row[VELOCITY], np.zeros(n)
    round_trip = JointTrajectory.of_arrays(
        [str(k) for k in range(n)], [0.0, 2.0 * duration], [position, position], [velocity, -velocity], [still, still]
    )
    turn, _, bend = round_trip.sample(duration)
    part = _part(np.arange(n), duration, (position, turn), (velocity, still), (still, bend), row[EFFORT])
    return Course.hold(position, row[EFFORT]).with_part(part)


def _part(
    columns: npt.NDArray[np.intp],
    duration: float,
    positions: Sequence[Array],
    velocities: Sequence[Array],
    accelerations: Sequence[Array] | None,
    effort: Array,
) -> Part:
    """Two points, and an effort that stays."""
    names = [str(k) for k in columns]
    efforts = np.tile(effort[columns], (2, 1))
    return Part(
        columns,
        JointTrajectory.of_arrays(
            names, [0.0, duration], np.array(positions), np.array(velocities), accelerations, efforts
        ),
        0.0,
    )
