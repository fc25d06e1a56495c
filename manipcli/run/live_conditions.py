"""A run as conditions see it while it goes on: the same moments that its recording will hold, some ticks at a time.

Contacts are those that are recorded and times are rounded as in the log, so that what a probe answers live is what
judging the log gives for the same ticks. Who listens to every answer is told at every tenth tick; the others are looked
at when they are asked, or when there is no more room for what they have not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from manipcli.conditions.condition import World
from manipcli.conditions.formula import absent, opened
from manipcli.conditions.members import CONDITIONS
from manipcli.conditions.robustness import Robustness
from manipcli.conditions.state_window import Reference, StateWindow, StepTime, Touching
from manipcli.control.controller import Controller, ControllerOutput
from manipcli.model.state import Contact, WorldState
from manipcli.record.channels import ControllerChannel
from manipcli.run.run_log import recorded
from manipcli.simulate.session import SLOW
from manipcli.spec.condition import ConditionSpec

Told = Callable[[StateWindow, Robustness], None]
"""Sees every answer of a probe: some ticks, and the margins on them. Neither is valid afterwards."""


ROOM: Final = 500
"""Ticks that are kept for probes that nobody asks."""


class Probe:
    """A condition that is asked while the run goes on, from the tick at which it was opened."""

    def __init__(
        self, spec: ConditionSpec, world: World, first: int, told: Told | None, catch_up: Callable[[], None]
    ) -> None:
        self._monitor = opened(spec, world, CONDITIONS)
        self._word = "" if spec.combines else f"{spec.name}: "
        self._first = first
        self._catch_up = catch_up
        self._held = False
        self._last: Robustness | None = None
        self.told = told

    @property
    def holds(self) -> bool:
        """Whether it held at the last tick."""
        self._catch_up()
        return self._held

    @property
    def missing(self) -> str:
        """`it fails by 3 mm: near: 'cup' is at ...`: how far it was from holding at the last tick.

        Only to be asked before the next tick, while the arrays of this one stand.
        """
        self._catch_up()
        if self._last is None:
            return ""
        if not self._last.applies[-1]:
            return self._word + self._last.idle
        found = self._last.found(len(self._last.margins) - 1)
        return f"it fails{found.lacking}: {self._word}{found.text}"

    def look(self, window: StateWindow, start: int) -> None:
        """The ticks of `moments`, of which the first has the number `start`; those before the opening are left out."""
        skipped = max(self._first - start, 0)
        if skipped >= len(window.times):
            return
        shown = window.part(skipped, len(window.times))
        answer = self._last = self._monitor(shown)
        self._held = bool(answer.applies[-1] and answer.margins[-1] >= 0.0)
        if self.told is not None:
            self.told(shown, answer)


class Live:
    """Gathers ticks and asks the open probes; an observer beside the recorder.

    Args:
        world: of the run.
        controllers: in the order of the outputs given to `tick`.
        period: [s] of a tick.
    """

    def __init__(self, world: World, controllers: Sequence[Controller], period: float) -> None:
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
        self._listens = False
        self._count = 0
        self._next = 0

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        """The next tick; the arrays may be reused afterwards."""
        k = self._count
        self._numbers[k + 1] = state.numbers
        if self._probes:
            for index, reference in self._references:
                output = outputs[index]
                reference.position[k] = np.nan if output is None else output.position
        self._count, self._next = k + 1, tick + 1
        if self._count == ROOM or (self._listens and self._next % SLOW == 0):
            self._ask()

    def contacts(self, tick: int, contacts: Sequence[Contact]) -> None:
        """Everything that touches, as it is recorded; told before the tick."""
        self._contacts.append(Touching(self._moment(tick), tuple(contacts)))

    def step_started(self, step: str) -> None:
        """The next tick is the first of a step."""
        if self._steps[step].started is None:
            self._steps[step] = StepTime(step, self._moment(self._next), None, "")

    def step_ended(self, step: str, outcome: str) -> None:
        """The last tick was the last of a step."""
        self._steps[step] = StepTime(step, self._steps[step].started, self._moment(self._next), outcome)

    def absent(self, spec: ConditionSpec) -> str | None:
        """Why a condition cannot be asked in this run, or None."""
        return absent(spec, self._world, CONDITIONS)

    def open(self, spec: ConditionSpec, *, told: Told | None = None) -> Probe:
        """Ask a condition from the next tick on, until it is closed.

        Args:
            spec: one that is not `absent`.
            told: called with every answer.
        """
        self._ask()
        probe = Probe(spec, self._world, self._next, told, self._ask)
        self._probes.append(probe)
        self._listens = self._listens or told is not None
        return probe

    def close(self, probe: Probe) -> None:
        """Ask it about the ticks since it was asked last, and no more."""
        self._ask()
        self._probes.remove(probe)
        self._listens = any(probe.told is not None for probe in self._probes)

    def _ask(self) -> None:
        """All probes, about the ticks that they have not seen."""
        if not self._count:
            return
        if self._probes:
            window = self._moments()
            start = self._next - self._count
            for probe in self._probes:
                probe.look(window, start)
        self._numbers[0] = self._numbers[self._count]
        del self._contacts[:-1]
        self._count, self._first = 0, False

    def _moments(self) -> StateWindow:
        count = self._count
        first = self._next - count
        self._rows.time[: count + 1] = [self._moment(tick) for tick in range(first - 1, self._next)]
        return StateWindow(
            states=self._rows.map(lambda a: a[1 : count + 1]),
            before=None if self._first else self._before,
            references=tuple(Reference(one.joints, one.position[:count]) for _, one in self._references),
            contacts=tuple(self._contacts),
            steps=tuple(self._steps.values()),
        )

    def _moment(self, tick: int) -> float:
        """The time of a tick as the log has it: whole nanoseconds."""
        return round(tick * self._period * 1e9) / 1e9
