"""Where a course is at each tick, and what of the command is known without measuring anything."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from manipcli.control.course import ACCELERATION, EFFORT, POSITION, VELOCITY, Course
from manipcli.core.geometry import Array
from manipcli.spec.controllers import Interface

ON_TICK: Final = 1e-3
"""A time nearer than this, in periods, to a tick of the course is that tick."""
BLOCK: Final = 32
"""Ticks that are sampled at once where they were not before."""


class Feeds:
    """The part of a command that does not depend on the error: (k, n) for the k interfaces of a controller.

    It looks one period ahead, for a command is what the joint shall have when the next tick measures it: the position,
    velocity or acceleration of the course; beside a PID `velocity_scale` times its velocity; and its effort.
    """

    def __init__(self, interfaces: Sequence[Interface], *, velocity_scale: Array | None) -> None:
        self._rows = {"position": POSITION, "velocity": VELOCITY, "acceleration": ACCELERATION, "effort": EFFORT}
        self._interfaces = tuple(interfaces)
        self._scale = velocity_scale

    def of(self, ahead: Array) -> Array | None:
        """(T, k, n) of the samples (T, 4, n) one period ahead; None: always 0."""
        if self._scale is None:
            return ahead[:, [self._rows[interface] for interface in self._interfaces]]
        feed = self._scale * ahead[:, VELOCITY]
        if self._interfaces == ("effort",):
            feed = feed + ahead[:, EFFORT]
        return feed[:, None] if feed.any() else None


class Reference:
    """Follows one course after the other, in a clock that runs `speed` seconds a second.

    At the ticks of the period with which a course began, and at full speed, its samples were made beforehand; otherwise
    they are made a block at a time.

    Args:
        rows: (3, n) written in place: position, velocity, acceleration; rad or m, per second, per second squared.
        feeds: see there.

    Attributes:
        rows: see above.
        feed: (k, n) of this tick, or None: 0.
        moving: whether `advance` has anything to do.
        ended: whether the course is over.
        end: [s] of the course's clock.
        speed: of the clock.
        scales: whether `rescale` changes it; a stop does not wait.
    """

    __slots__ = (
        "_before", "_course", "_dt", "_end_row", "_feeds", "_last", "_law", "_origin", "_since", "_table", "end",
        "ended", "feed", "moving", "rows", "scales", "speed",
    )  # fmt: skip

    def __init__(self, rows: Array, feeds: Feeds) -> None:
        self.rows = rows
        self._law = feeds
        self.speed = 1.0
        self.hold(Course.hold(np.zeros(rows.shape[1])), time=0.0)

    def hold(self, course: Course, *, time: float) -> None:
        """From now on what `course` rests at."""
        self._course = course
        self.rows[:] = course.rest[:EFFORT]
        feed = self._law.of(course.rest[None])
        self.feed = None if feed is None else feed[0]
        self.moving, self.ended, self.scales = False, True, False
        self.end, self._before, self._since, self.speed = 0.0, 0.0, time, 1.0
        self._table = np.zeros((0, EFFORT, self.rows.shape[1]))
        self._feeds: Array | None = None
        self._origin, self._dt, self._last, self._end_row = time, math.inf, -1, 0

    def follow(self, course: Course, samples: Array, *, time: float, period: float, speed: float | None = None) -> None:
        """From now on `course`, which begins at `time`; `samples` are its `ticks` of `period`; `speed` None: 1."""
        self._course = course
        self.scales = speed is not None
        self.end = course.end
        self._before, self._since, self.speed = 0.0, time, 1.0 if speed is None else speed
        self._take(samples, time, period)
        self._end_row = len(samples) - 2
        if self.speed != 1.0:
            self._last = -1
        self.moving, self.ended = True, False

    def clock(self, time: float) -> float:
        """[s] of the course at `time`."""
        return self._before + (time - self._since) * self.speed

    def rescale(self, speed: float, *, time: float) -> None:
        """From `time` on the clock runs so fast; the samples made beforehand are of no use any more."""
        if self.moving and self.scales and speed != self.speed:
            self._before, self._since = self.clock(time), time
            self._last = -1
            self.speed = speed

    def advance(self, time: float, period: float) -> None:
        """Writes `rows`, `feed` and `ended` of `time` [s], where the next is a `period` later."""
        ticks = (time - self._origin) / self._dt
        row = int(ticks + 0.5)
        if not (row < self._last and -ON_TICK < ticks - row < ON_TICK and period == self._dt):
            self._look_ahead(time, period)
            row = 0
        self.rows[:] = self._table[row]
        if self._feeds is not None:
            self.feed = self._feeds[row]
        self.ended = row >= self._end_row

    def _look_ahead(self, time: float, period: float) -> None:
        """Samples of the next ticks, for a time that is none of those that were sampled before."""
        step = self.speed * period
        clocks = np.maximum(self.clock(time) + step * np.arange(BLOCK + 1), 0.0)
        self._take(self._sample(clocks), time, period)
        self._end_row = int(np.searchsorted(clocks, self.end - 1e-6 * period))
        if clocks[0] > self.end + 1e-6 * period:
            self.moving = False

    def _take(self, samples: Array, time: float, period: float) -> None:
        """Samples (T, 4, n) of the ticks from `time` on; of the last one only its feed is used."""
        self._table = samples[:, :EFFORT]
        self._feeds = self._law.of(samples[1:])
        self.feed = None
        self._origin, self._dt, self._last = time, period, len(samples) - 1

    def _sample(self, clock: Array) -> Array:
        rows = self._course.sample(clock)
        if self.speed != 1.0:
            rows[:, VELOCITY] *= self.speed
            rows[:, ACCELERATION] *= self.speed**2
        return rows

    def row(self, time: float) -> Array:
        """(4, n) what is followed at `time`, a second of real time."""
        return np.asarray(self._sample(np.array([max(0.0, self.clock(time))]))[0])

    def now(self, time: float) -> Course:
        """What is left of the course at `time`."""
        return self._course.from_time(max(0.0, self.clock(time)))
