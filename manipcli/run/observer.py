"""Who looks on while a plan is carried out: recorder and live conditions, and whoever shows how far it is."""

from __future__ import annotations

import time as wall_clock
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from manipcli.control.action import GoalHandle
from manipcli.control.controller import ControllerOutput
from manipcli.core.errors import Diagnostic
from manipcli.judge.verdict import StepOutcome
from manipcli.model.state import Contact, WorldState
from manipcli.record.write.contact_filter import ContactFilter
from manipcli.record.write.recorder import Recorder
from manipcli.run.live_conditions import Live
from manipcli.task.plan_task import PlannedStep

FEEDBACK_PERIOD: Final = 0.05
"""[s] between two records of how far a goal is, as ROS's action servers tell it."""
PROGRESS_TICKS: Final = 50
"""Control ticks between two times that are told to whoever shows the progress."""


class Progress(Protocol):
    """Whoever shows how far a run is."""

    def doing(self, what: str) -> None:
        """A sign of life while no time goes by: a step is planned, a part of the log is judged."""
        ...

    def warned(self, findings: Sequence[Diagnostic]) -> None:
        """What may go wrong, known before the first step: once of the files, once of the plan."""
        ...

    def step_started(self, step: PlannedStep, index: int, total: int) -> None:
        """Step `index` (from 0) of `total` begins."""
        ...

    def told(self, text: str, *, detail: bool) -> None:
        """Something that was not planned happened in the step that is on; a `detail` is not for everyone."""
        ...

    def tick(self, simulated_time: float, wall: float) -> None:
        """Now and then; both [s] from the start."""
        ...

    def step_ended(self, outcome: StepOutcome) -> None:
        """A step is over, well or not."""
        ...


class _Silent:
    """Shows nothing."""

    def doing(self, what: str) -> None: ...
    def warned(self, findings: Sequence[Diagnostic]) -> None: ...
    def step_started(self, step: PlannedStep, index: int, total: int) -> None: ...
    def told(self, text: str, *, detail: bool) -> None: ...
    def tick(self, simulated_time: float, wall: float) -> None: ...
    def step_ended(self, outcome: StepOutcome) -> None: ...


SILENT: Final = _Silent()


@dataclass(frozen=True, slots=True)
class _Goal:
    """A goal on its way, and the number by which the log knows it."""

    controller: str
    number: int
    handle: GoalHandle


class Observer:
    """Hands every tick to the recorder and to live conditions, and now and then the time to who shows the progress."""

    def __init__(self, recorder: Recorder, live: Live, progress: Progress, period: float) -> None:
        self._recorder = recorder
        self._live = live
        self._progress = progress
        self._period = period
        self._began = wall_clock.perf_counter()
        self._filter = ContactFilter()
        self._feedback_ticks = max(1, round(FEEDBACK_PERIOD / period))
        self._next_tick = 0
        self._goals: list[_Goal] = []

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        self._recorder.tick(tick, state, outputs)
        self._live.tick(tick, state, outputs)
        self._next_tick = tick + 1
        due = tick % self._feedback_ticks == 0
        for goal in self._goals:
            if due or goal.handle.result is not None:
                self._follow(tick)
                break
        if tick % PROGRESS_TICKS == 0:
            self._progress.tick(tick * self._period, wall_clock.perf_counter() - self._began)

    def contacts(self, tick: int, contacts: tuple[Contact, ...]) -> None:
        changed = self._filter.changed(tick * self._period, contacts)
        if changed is not None:
            self._recorder.contacts(tick, changed)
            self._live.contacts(tick, changed)

    def goal(self, controller: str, handle: GoalHandle) -> None:
        """A controller has a new goal; one that it had before may have ended by that."""
        self._follow(self._next_tick)
        self._goals.append(_Goal(controller, self._recorder.goal_sent(self._next_tick, controller), handle))

    def _follow(self, tick: int) -> None:
        """Records the ends of goals, and now and then how far they are."""
        for goal in [*self._goals]:
            result = goal.handle.result
            if result is not None:
                self._recorder.goal_ended(tick, goal.controller, goal.number, result, goal.handle.feedback())
                self._goals.remove(goal)
            elif tick % self._feedback_ticks == 0 and tick < self._next_tick:
                self._recorder.goal_feedback(tick, goal.controller, goal.number, goal.handle.feedback())
