"""What a condition may look at: successive control ticks of one run, live or recorded, in the same form.

A live run hands on what was not yet seen, up to half a second, a recording half a second at a time: a condition gives
the same answer either way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, rotation_between
from manipcli.model.state import Contact, WorldState

ROUNDING = 0.5e-9
"""[s] Recorded times are whole nanoseconds: two that differ by no more are the same."""


@dataclass(frozen=True, slots=True)
class Reference:
    """What one controller follows: `position` (T, k) [rad or m] of its `joints`, NaN while it is not active."""

    joints: tuple[str, ...]
    position: Array


@dataclass(frozen=True, slots=True)
class Touching:
    """All contacts from `time` [s] on, until the next."""

    time: float
    contacts: tuple[Contact, ...]


@dataclass(frozen=True, slots=True)
class StepTime:
    """When a step ran [s], as far as is known; `outcome` is empty until it ended."""

    id: str
    started: float | None
    ended: float | None
    outcome: str


@dataclass(frozen=True, slots=True)
class StateWindow:
    """Successive control ticks.

    Attributes:
        states: with a leading time axis T. Velocities of bodies in it are not to be used: see `body_velocity`.
        before: the state one tick earlier, without time axis; None at the first tick of the run.
        references: of every controller that is recorded.
        contacts: changes of what touches, in order; the first may be older than the first tick, and holds on it.
        steps: all steps of the task.
    """

    states: WorldState
    before: WorldState | None
    references: tuple[Reference, ...]
    contacts: tuple[Touching, ...]
    steps: tuple[StepTime, ...]

    @property
    def times(self) -> Array:
        """(T,) [s]"""
        return self.states.time

    def part(self, first: int, last: int) -> StateWindow:
        """The ticks from `first` up to and without `last`."""
        if first == 0 and last == len(self.times):
            return self
        valid = int(np.searchsorted([one.time for one in self.contacts], self.times[first], side="right")) - 1
        return replace(
            self,
            states=self.states.map(lambda a: a[first:last]),
            before=self.states.map(lambda a: a[first - 1]) if first > 0 else self.before,
            references=tuple(Reference(one.joints, one.position[first:last]) for one in self.references),
            contacts=self.contacts[max(valid, 0) :],
        )

    def touching(self, k: int) -> tuple[Contact, ...]:
        """What touches at tick `k`."""
        found = [one.contacts for one in self.contacts if one.time <= self.times[k]]
        return found[-1] if found else ()

    def of_contacts(self, value: Callable[[Sequence[Contact]], float]) -> Array:
        """(T,) `value` of what touches at each tick."""
        values = np.array([value(()), *(value(one.contacts) for one in self.contacts)])
        return values[self._which()]

    def _which(self) -> npt.NDArray[np.intp]:
        """(T,) which of `contacts` holds at each tick, counted from 1; 0: none yet."""
        return np.searchsorted(np.array([one.time for one in self.contacts]), self.times, side="right")

    def body_velocity(self, k: int) -> tuple[Array, Array]:
        """Velocity of the frame O of movable body `k` over the last tick; zero at the first tick of the run.

            v_t = (p_t - p_{t-1}) / (time_t - time_{t-1}),  w_t = log(q_t q_{t-1}^-1) / (time_t - time_{t-1})

        It needs nothing but poses and the past, so that it is the same live and recorded.

        Returns:
            Linear (T, 3) [m/s] and angular (T, 3) [rad/s] velocity in the world.
        """
        states, before = self.states, self.before
        if before is None:
            before = states.map(lambda a: a[0])
        time = np.concatenate([before.time[None], states.time])
        p = np.concatenate([before.body_position[None, k], states.body_position[:, k]])
        q = np.concatenate([before.body_quat_xyzw[None, k], states.body_quat_xyzw[:, k]])
        passed = np.diff(time)[:, None]
        passed = np.where(passed > 0.0, passed, np.inf)
        return np.diff(p, axis=0) / passed, rotation_between(q[:-1], q[1:]) / passed
