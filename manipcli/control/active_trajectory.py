"""Active trajectory of a controller: for each joint the latest trajectory, on one clock, and its samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.control.compiled import bind
from manipcli.control.trajectory_clock import TrajectoryClock
from manipcli.core.geometry import Array
from manipcli.plan.trajectory import JointTrajectory
from manipcli.spec.controllers import Interface

POSITION, VELOCITY, ACCELERATION, EFFORT = 0, 1, 2, 3
"""The rows of a sample (4, n): a reference, and the effort to add to the command."""
ROWS: Final[dict[Interface, int]] = {
    "position": POSITION, "velocity": VELOCITY, "acceleration": ACCELERATION, "effort": EFFORT,
}  # fmt: skip

INSTANT = 1e-9
"""Times nearer than this [s] are the same: ticks are rounded."""

Columns = slice | npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A trajectory of the joints at `columns`, which begins at `begin` [s] of the clock; its joints rest at its end."""

    columns: Columns
    trajectory: JointTrajectory
    begin: float

    @property
    def end(self) -> float:
        return self.begin + self.trajectory.duration


@dataclass(frozen=True, slots=True, eq=False)
class ActiveTrajectory:
    """`rest` (4, n) applies to each joint until a part begins; a later part takes joints over from an earlier one."""

    rest: Array
    parts: tuple[Part, ...] = ()

    @staticmethod
    def hold(position: Array, effort: Array | float = 0.0) -> ActiveTrajectory:
        """A trajectory at rest at `position` (n)."""
        rest = np.zeros((4, len(position)))
        rest[POSITION], rest[EFFORT] = position, effort
        return ActiveTrajectory(rest)

    @property
    def end(self) -> float:
        """[s] Time from which all joints rest."""
        ends = np.zeros(self.rest.shape[1])
        for part in self.parts:
            ends[part.columns] = part.end
        return float(ends.max())

    def sample(self, times: Array) -> Array:
        """(T, 4, n) at ascending `times` (T) [s] of its clock."""
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

    def from_time(self, now: float) -> ActiveTrajectory:
        """The same trajectory with `now` as its time 0."""
        if self.end <= now:
            return ActiveTrajectory(self.sample(np.array([now]))[0])
        return ActiveTrajectory(
            self.rest, tuple(Part(part.columns, part.trajectory, part.begin - now) for part in self.parts)
        )

    def with_part(self, part: Part) -> ActiveTrajectory:
        """With a part that takes its joints over; parts without a joint left are dropped."""
        kept: list[Part] = []
        taken = np.zeros(self.rest.shape[1], dtype=np.bool_)
        for candidate in (part, *reversed(self.parts)):
            if not taken[candidate.columns].all():
                kept.insert(0, candidate)
            if candidate.begin <= INSTANT:
                taken[candidate.columns] = True
        return ActiveTrajectory(self.rest, tuple(kept))


ON_TICK: Final = 1e-3
"""A time within this tolerance, in periods, of a sampled tick counts as that tick."""
BLOCK: Final = 32
"""Number of ticks that are sampled at once if no samples exist."""
CHANGING: Final = 8
"""Likewise while the speed changes, which takes longer."""


class Reference:
    """Follows successive active trajectories, on a `TrajectoryClock`.

    At full speed and at the ticks of the period with which a trajectory began, it is sampled in advance; otherwise it
    is sampled in blocks.

    It also gives the part of a command that does not depend on the error, one period ahead, because the joint executes
    a command by the time the next tick measures it: the position, velocity or acceleration of the trajectory; with
    a PID `velocity_scale` times its velocity; and its effort.

    Args:
        rows: (3, n) written in place: position, velocity, acceleration; rad or m, per second, per second squared.
        interfaces: (k) of the command.
        velocity_scale: (n) of the feed-forward beside a PID; None: there is no PID.
        acceleration: (n) limits, which a smooth change of the speed keeps; None: there are none.

    Attributes:
        rows: see above.
        feed_room: (k, n) the part of this tick.
        feeds: whether it is anything but 0.
        moving: whether `advance` has anything to do.
        ended: whether the trajectory is over.
        end: [s] of the trajectory's clock.
        scales: whether `rescale` has an effect; a stop is not scaled.
    """

    __slots__ = (
        "_active", "_at", "_clock", "_dt", "_end_row", "_feeds", "_interfaces", "_last", "_limits", "_origin", "_scale",
        "_table", "end", "ended", "feed_room", "feeds", "moving", "rows", "scales",
    )  # fmt: skip

    def __init__(
        self,
        rows: Array,
        interfaces: Sequence[Interface],
        *,
        velocity_scale: Array | None = None,
        acceleration: Array | None = None,
    ) -> None:
        self.rows = rows
        self._limits = np.full(rows.shape[1], np.inf) if acceleration is None else acceleration
        self._interfaces = tuple(interfaces)
        self._scale = velocity_scale
        self.feed_room = np.zeros((len(self._interfaces) if velocity_scale is None else 1, rows.shape[1]))
        self.hold(ActiveTrajectory.hold(np.zeros(rows.shape[1])), time=0.0)

    def hold(self, active: ActiveTrajectory, *, time: float, ahead: Array | None = None) -> None:
        """From now on, the rest of `active`; `ahead` (4, n): what is fed forward, where the rest is for one tick."""
        self._active = active
        self.rows[:] = active.rest[:EFFORT]
        feed = self._feed((active.rest if ahead is None else ahead)[None])
        self.feeds = feed is not None
        self.feed_room[:] = 0.0 if feed is None else feed[0]
        self.moving, self.ended, self.scales = False, True, False
        self.end, self._clock = 0.0, TrajectoryClock(time)
        self._table = np.zeros((0, EFFORT, self.rows.shape[1]))
        self._feeds: Array | None = None
        self._origin, self._dt, self._end_row = time, math.inf, 0
        self._drop()

    def follow(
        self, active: ActiveTrajectory, samples: Array, *, time: float, period: float, speed: float | None = None
    ) -> None:
        """From now on, follow `active`, which begins at `time`; `samples`: its `ticks` of `period`; `speed` None: 1."""
        self._active = active
        self.scales = speed is not None
        self.end = active.end
        self._clock = TrajectoryClock(time, 1.0 if speed is None else speed)
        self._take(samples, time, period)
        self._end_row = len(samples) - 2
        if speed not in (None, 1.0):
            self._drop()
        self.moving, self.ended = True, False

    def clock(self, time: float) -> float:
        """Time [s] of the trajectory at `time`."""
        return self._clock.now(time)[0]

    def speed(self, time: float) -> tuple[float, float]:
        """Trajectory seconds per second at `time`, and the rate of that [1/s]."""
        return self._clock.now(time)[1:]

    def rescale(self, speed: float, *, time: float) -> None:
        """From `time` on the clock runs at this speed; samples made in advance are dropped."""
        if self.moving and self.scales and (speed, 0.0) != self.speed(time):
            self._clock.jump(speed, time)
            self._drop()

    def change_speed(self, speed: float, *, time: float, period: float) -> None:
        """From the tick at `time` on, change to this speed smoothly."""
        if not self.scales or (speed, 0.0) == self.speed(time):
            return
        if self.moving:
            path = self._active.sample
            self._clock.change(speed, time, period, lambda s: path(np.array([s]))[0], self._limits)
            self._drop()
            self.advance(time, period)
        else:
            self._clock.jump(speed, time)

    def scale_feed(self, scale: Array) -> None:
        """From the next tick on, `velocity_scale` is `scale` (n)."""
        if not np.array_equal(scale, self._scale):  # type: ignore[arg-type]
            self._scale = scale
            self._drop()

    def advance(self, time: float, period: float) -> None:
        """Writes `rows`, `feed_room` and `ended` of `time` [s], where the next is a `period` later."""
        row = self._at(time, period)
        if row < 0:
            self._look_ahead(time, period)
            row = self._at(time, period)
        self.ended = row >= self._end_row

    def _sampled(self, time: float, period: float) -> int:
        """Writes `rows` and `feed_room` of `time` from the samples; returns their row, or -1: there is no sample."""
        ticks = (time - self._origin) / self._dt
        row = int(ticks + 0.5)
        if not (row < self._last and -ON_TICK < ticks - row < ON_TICK and period == self._dt):
            return -1
        self.rows[:] = self._table[row]
        if self._feeds is not None:
            self.feed_room[:] = self._feeds[row]
        return row

    def _look_ahead(self, time: float, period: float) -> None:
        """Samples the next ticks, for a time that is not sampled yet."""
        count = BLOCK if self._clock.is_steady(time) else CHANGING
        clocks, speeds, rates = self._clock.ahead(time, period, count + 1)
        np.maximum(clocks, 0.0, out=clocks)
        self._take(self._sample(clocks, speeds, rates), time, period)
        self._end_row = int(np.searchsorted(clocks, self.end - 1e-6 * period))
        if clocks[0] > self.end + 1e-6 * period:
            self.moving = False

    def _take(self, samples: Array, time: float, period: float) -> None:
        """Samples (T, 4, n) of the ticks from `time` on; of the last one only its feed is used."""
        self._table = samples[:, :EFFORT]
        self._feeds = self._feed(samples[1:])
        self.feeds = self._feeds is not None
        self._origin, self._dt, self._last = time, period, len(samples) - 1
        clock = np.array([time, period, self._last, ON_TICK])
        feeds = np.zeros(0) if self._feeds is None else np.ascontiguousarray(self._feeds)
        n = self.rows.shape[1]
        self._at = bind("sample", n, samples, feeds, clock, self.rows, self.feed_room) or self._sampled

    def _drop(self) -> None:
        """No time is sampled."""
        self._last, self._at = -1, self._sampled

    def _feed(self, ahead: Array) -> Array | None:
        """(T, k, n) of the samples (T, 4, n) one period ahead; None: always 0."""
        if self._scale is None:
            return ahead[:, [ROWS[interface] for interface in self._interfaces]]
        feed = self._scale * ahead[:, VELOCITY]
        if self._interfaces == ("effort",):
            feed = feed + ahead[:, EFFORT]
        return feed[:, None] if feed.any() else None

    def _sample(self, clocks: Array, speeds: Array, rates: Array) -> Array:
        """(T, 4, n) at clocks (T), with derivatives per second of real time."""
        rows = self._active.sample(clocks)
        if (speeds != 1.0).any() or rates.any():
            rows[:, ACCELERATION] *= speeds[:, None] ** 2
            rows[:, ACCELERATION] += rows[:, VELOCITY] * rates[:, None]
            rows[:, VELOCITY] *= speeds[:, None]
        return rows

    def row(self, time: float) -> Array:
        """(4, n) the reference at `time`, with derivatives per second of real time."""
        clock, speed, rate = self._clock.now(time)
        return np.asarray(self._sample(np.array([max(0.0, clock)]), np.array([speed]), np.array([rate]))[0])

    def now(self, time: float) -> ActiveTrajectory:
        """The remaining trajectory at `time`."""
        return self._active.from_time(max(0.0, self.clock(time)))
