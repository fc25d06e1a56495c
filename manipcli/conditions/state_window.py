"""Successive control ticks of one run, live or recorded, in one form: the input of conditions.

A live run passes on its new ticks, up to half a second at once; a recording passes on half a second at a time. A
condition gives the same margins in both cases.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from manipcli.conditions.sensed import Readings
from manipcli.core.geometry import Array, rotation_between
from manipcli.model.state import Contact, WorldState

ROUNDING = 0.5e-9
"""[s] Recorded times are whole nanoseconds: times that differ by less are equal."""


@dataclass(frozen=True, slots=True)
class Reference:
    """The reference of a controller: `position` (T, k) [rad or m] of its `joints`, NaN while it is inactive."""

    joints: tuple[str, ...]
    position: Array


@dataclass(frozen=True, slots=True)
class Touching:
    """All contacts from `time` [s] until the next change."""

    time: float
    contacts: tuple[Contact, ...]


@dataclass(frozen=True, slots=True)
class StepTime:
    """Start and end of a step [s], None while unknown; `outcome` is empty until the step ends."""

    id: str
    started: float | None
    ended: float | None
    outcome: str


@dataclass(frozen=True, slots=True)
class StateWindow:
    """Successive control ticks.

    Attributes:
        states: with a leading time axis T. Do not use its body velocities: see `body_velocity`.
        before: the state one tick earlier, without time axis; None at the first tick of the run.
        references: of every recorded controller.
        contacts: changes of the contacts, in order; the first may be older than the first tick and is valid there.
        steps: all steps of the task.
        belief: the same ticks with the body poses that the robot believes; None: they are those of this window.
        readings: of the sensors that conditions ask for, by name; the first may be older than the first tick.
    """

    states: WorldState
    before: WorldState | None
    references: tuple[Reference, ...]
    contacts: tuple[Touching, ...]
    steps: tuple[StepTime, ...]
    belief: StateWindow | None = None
    readings: Mapping[str, Readings] = field(default_factory=dict)

    @property
    def times(self) -> Array:
        """(T,) [s]"""
        return self.states.time

    def part(self, first: int, last: int) -> StateWindow:
        """The ticks from `first` up to, not including, `last`."""
        if first == 0 and last == len(self.times):
            return self
        valid = int(np.searchsorted([change.time for change in self.contacts], self.times[first], side="right")) - 1
        return replace(
            self,
            states=self.states.map(lambda a: a[first:last]),
            before=self.states.map(lambda a: a[first - 1]) if first > 0 else self.before,
            references=tuple(Reference(r.joints, r.position[first:last]) for r in self.references),
            contacts=self.contacts[max(valid, 0) :],
            belief=None if self.belief is None else self.belief.part(first, last),
        )

    def touching(self, k: int) -> tuple[Contact, ...]:
        """The contacts at tick `k`."""
        found = [change.contacts for change in self.contacts if change.time <= self.times[k]]
        return found[-1] if found else ()

    def of_contacts(self, value: Callable[[Sequence[Contact]], float]) -> Array:
        """(T,) `value` of the contacts at each tick."""
        values = np.array([value(()), *(value(change.contacts) for change in self.contacts)])
        return values[self._which()]

    def _which(self) -> npt.NDArray[np.intp]:
        """(T,) the number of the change in `contacts` that is valid at each tick, from 1; 0: none yet."""
        return np.searchsorted(np.array([change.time for change in self.contacts]), self.times, side="right")

    def body_velocity(self, k: int) -> tuple[Array, Array]:
        """Velocity of the frame O of movable body `k` over the last tick; zero at the first tick of the run.

            v_t = (p_t - p_{t-1}) / (time_t - time_{t-1}),  w_t = log(q_t q_{t-1}^-1) / (time_t - time_{t-1})

        It uses only poses and past ticks, so it is the same live and recorded.

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
