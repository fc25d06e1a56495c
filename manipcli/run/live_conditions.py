"""Evaluation of conditions during a run, on the same state windows that its recording gives.

Contacts are the recorded ones and times are rounded as in the log, so a probe gives the same result as judging the log.
Probes with a callback are evaluated every tenth tick; others when they are read, or when the buffer of ticks is full.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from manipcli.conditions.condition import World
from manipcli.conditions.formula import absent, opened, sensors_of
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.robustness import EDGE, Robustness
from manipcli.conditions.state_window import Reference, StateWindow, StepTime, Touching
from manipcli.control.controller import Controller, ControllerOutput
from manipcli.control.felt_force import FeltForce
from manipcli.core.units import readable
from manipcli.model.state import Contact, WorldState
from manipcli.record.channels import ControllerChannel
from manipcli.run.run_log import recorded
from manipcli.run.sensor_readings import SensorReadings
from manipcli.simulate.sensor import Picture
from manipcli.simulate.sensor_bank import SensorBank
from manipcli.simulate.session import SLOW
from manipcli.spec.condition import ConditionSpec

Callback = Callable[[StateWindow, Robustness], None]
"""Receives each evaluation of a probe; both arguments are valid only during the call."""

ROOM: Final = 500
"""Number of ticks in the buffer."""


class Probe:
    """A condition evaluated during the run, from the tick at which it was opened."""

    def __init__(
        self, spec: ConditionSpec, world: World, first: int, callback: Callback | None, catch_up: Callable[[], None]
    ) -> None:
        self._monitor = opened(spec, world, CONDITIONS)
        self._word = "" if spec.combines else f"{spec.name}: "
        self._first = first
        self._catch_up = catch_up
        self._held = False
        self._last: Robustness | None = None
        self.callback = callback

    @property
    def holds(self) -> bool:
        """Whether it holds at the last tick."""
        self._catch_up()
        return self._held

    @property
    def missing(self) -> str:
        """Why it fails at the last tick: `it fails by 3 mm: near: 'cup' is ...`.

        Read it before the next tick, which overwrites the arrays.
        """
        self._catch_up()
        if self._last is None:
            return ""
        if not self._last.applies[-1]:
            return self._word + self._last.idle
        found = self._last.found(len(self._last.margins) - 1)
        return f"it fails{found.lacking}: {self._word}{found.text}"

    @property
    def found(self) -> str:
        """What was measured at the last tick: `it holds by 3 mm: near: 'cup' is ...`; `missing` if it fails."""
        if not self.holds or self._last is None:
            return self.missing
        found = self._last.found(len(self._last.margins) - 1)
        by = f" by {readable(found.margin, found.unit)}" if found.unit and found.margin > EDGE else ""
        return f"it holds{by}: {self._word}{found.text}"

    @property
    def margin(self) -> tuple[float, str] | None:
        """The margin at the last tick and its unit; None where it is not asked."""
        self._catch_up()
        if self._last is None or not self._last.applies[-1]:
            return None
        found = self._last.found(len(self._last.margins) - 1)
        return found.margin, found.unit

    def look(self, window: StateWindow, start: int) -> None:
        """Evaluate a window whose first tick has the number `start`, without ticks before the opening."""
        skipped = max(self._first - start, 0)
        if skipped >= len(window.times):
            return
        shown = window.part(skipped, len(window.times))
        answer = self._last = self._monitor(shown)
        self._held = bool(answer.applies[-1] and answer.margins[-1] >= 0.0)
        if self.callback is not None:
            self.callback(shown, answer)


class Live:
    """Collects ticks and evaluates the open probes.

    Args:
        world: of the run.
        controllers: in the order of the outputs given to `tick`.
        period: [s] control period.
        sensors: of the session.
    """

    def __init__(self, world: World, controllers: Sequence[Controller], period: float, sensors: SensorBank) -> None:
        self._world = world
        self._period = period
        self._probes: list[Probe] = []
        self._steps = {name: StepTime(name, None, None, "") for name in world.steps}
        self._contacts: list[Touching] = []
        n, m = len(world.robot.joint_names), len(world.scene.movable)
        self._rows = WorldState.room(n, m, ROOM + 1)  # row 0 is the tick before the others
        self._rows.body_linear[:] = self._rows.body_angular[:] = np.nan
        self._numbers = self._rows.numbers
        self._before = self._rows.map(lambda a: a[0, ...])
        self._first = True
        self._references = [
            (k, Reference(controller.joints, np.full((ROOM, len(controller.joints)), np.nan)))
            for k, controller in enumerate(controllers)
            if isinstance(recorded(controller), ControllerChannel)
        ]
        felt = {own.name: own.arriving for own in controllers if isinstance(own, FeltForce)}
        self._sensors = SensorReadings(sensors, world.sensors, felt)
        self._listens = False
        self._count = 0
        self._next = 0

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        """Add the next tick; the arrays are copied."""
        k = self._count
        self._numbers[k + 1] = state.numbers
        if self._probes:
            for index, reference in self._references:
                output = outputs[index]
                reference.position[k] = np.nan if output is None else output.position
        if self._sensors.follows:
            self._sensors.tick(self._time(tick))
        self._count, self._next = k + 1, tick + 1
        if self._count == ROOM or (self._listens and self._next % SLOW == 0):
            self._ask()

    def contacts(self, tick: int, contacts: Sequence[Contact]) -> None:
        """Add a change of the recorded contacts, before its tick."""
        self._contacts.append(Touching(self._time(tick), tuple(contacts)))

    def picture(self, tick: int, name: str, picture: Picture) -> None:
        """Add a message of a camera, before its tick."""
        self._sensors.picture(self._time(tick), name, picture)

    def step_started(self, step: str) -> None:
        """The next tick is the first of a step, or of another attempt at it with the steps around it."""
        before = self._steps.get(step, StepTime(step, None, None, ""))  # a client of a live session adds steps
        if before.started is None or before.ended is not None:
            began = self._time(self._next) if before.started is None else before.started
            self._steps[step] = StepTime(step, began, None, "")

    def step_ended(self, step: str, outcome: str) -> None:
        """The last tick was the last of a step."""
        self._steps[step] = StepTime(step, self._steps[step].started, self._time(self._next), outcome)

    def step_reset(self, step: str, *, skipped: bool) -> None:
        """A step is to be done again, or its branch is not taken although it was done in an earlier attempt."""
        self._steps[step] = StepTime(step, None if skipped else self._steps[step].started, None, "")

    def absent(self, spec: ConditionSpec) -> str | None:
        """Why a condition cannot be evaluated in this run, or None."""
        return absent(spec, self._world, CONDITIONS)

    def open(self, spec: ConditionSpec, *, callback: Callback | None = None) -> Probe:
        """Evaluate a condition from the next tick until it is closed.

        Args:
            spec: a condition that is not `absent`.
            callback: called with every evaluation.
        """
        self._ask()
        for sensor in sensors_of(spec, CONDITIONS):
            self._sensors.follow(sensor, self._time(self._next - 1) if self._next else None)
        probe = Probe(spec, self._world, self._next, callback, self._ask)
        self._probes.append(probe)
        self._listens = self._listens or callback is not None
        return probe

    def close(self, probe: Probe) -> None:
        """Evaluate the remaining ticks, then stop."""
        self._ask()
        self._probes.remove(probe)
        self._listens = any(probe.callback is not None for probe in self._probes)

    def _ask(self) -> None:
        """Evaluate all probes on the buffered ticks."""
        if not self._count:
            return
        if self._probes:
            window = self._window()
            start = self._next - self._count
            for probe in self._probes:
                probe.look(window, start)
        self._numbers[0] = self._numbers[self._count]
        del self._contacts[:-1]
        self._sensors.forget()
        self._count, self._first = 0, False

    def _window(self) -> StateWindow:
        count = self._count
        first = self._next - count
        self._rows.time[: count + 1] = [self._time(tick) for tick in range(first - 1, self._next)]
        return StateWindow(
            states=self._rows.map(lambda a: a[1 : count + 1]),
            before=None if self._first else self._before,
            references=tuple(
                Reference(reference.joints, reference.position[:count]) for _, reference in self._references
            ),
            contacts=tuple(self._contacts),
            steps=tuple(self._steps.values()),
            readings=self._sensors.readings(),
        )

    def _time(self, tick: int) -> float:
        """The time [s] of a tick as in the log, in whole nanoseconds."""
        return round(tick * self._period * 1e9) / 1e9
