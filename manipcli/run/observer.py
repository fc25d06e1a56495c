"""Observer of a running plan: feeds every tick to the recorder, the live conditions and the progress display."""

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
from manipcli.run.belief import Belief
from manipcli.run.live_conditions import Live
from manipcli.task.plan_steps import PlannedStep

FEEDBACK_PERIOD: Final = 0.05
"""[s] Period of recorded goal feedback, as of ROS action servers."""
PROGRESS_TICKS: Final = 50
"""Control ticks between two updates of the progress display."""


class Progress(Protocol):
    """Display of the progress of a run."""

    def activity(self, what: str) -> None:
        """Activity without simulated time: a step is planned, a part of the log is judged."""
        ...

    def warned(self, findings: Sequence[Diagnostic]) -> None:
        """Warnings before the first step: called once for the files and once for the plan."""
        ...

    def step_started(self, step: PlannedStep, index: int, total: int) -> None:
        """Step `index` (from 0) of `total` begins."""
        ...

    def message(self, text: str, *, detail: bool) -> None:
        """An unplanned event of the current step, or of a block that it names; `detail`: only for verbose output."""
        ...

    def tick(self, simulated_time: float, wall: float) -> None:
        """Every `PROGRESS_TICKS` control ticks; both times [s] from the start."""
        ...

    def step_ended(self, outcome: StepOutcome) -> None:
        """A step ended, done or failed."""
        ...


class _Silent:
    def activity(self, what: str) -> None: ...
    def warned(self, findings: Sequence[Diagnostic]) -> None: ...
    def step_started(self, step: PlannedStep, index: int, total: int) -> None: ...
    def message(self, text: str, *, detail: bool) -> None: ...
    def tick(self, simulated_time: float, wall: float) -> None: ...
    def step_ended(self, outcome: StepOutcome) -> None: ...


SILENT: Final = _Silent()


@dataclass(frozen=True, slots=True)
class _Goal:
    """An active goal, and its number in the log."""

    controller: str
    number: int
    handle: GoalHandle


class Observer:
    """Feeds every tick to the recorder, to live conditions as the robot believes it, and the time to the display."""

    def __init__(self, recorder: Recorder, live: Live, progress: Progress, period: float, belief: Belief) -> None:
        self._recorder = recorder
        self._live = live
        self.belief = belief
        self._progress = progress
        self._period = period
        self._began = wall_clock.perf_counter()
        self._filter = ContactFilter()
        self._feedback_ticks = max(1, round(FEEDBACK_PERIOD / period))
        self._next_tick = 0
        self._goals: list[_Goal] = []

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        believed = self.belief.look(state)  # before the recorder copies its poses
        self._recorder.tick(tick, state, outputs)
        self._live.tick(tick, believed, outputs)
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
        """Record a new goal of a controller, which can end its previous goal."""
        self._follow(self._next_tick)
        self._goals.append(_Goal(controller, self._recorder.goal_sent(self._next_tick, controller), handle))

    def _follow(self, tick: int) -> None:
        """Record ends and feedback of goals."""
        for goal in [*self._goals]:
            result = goal.handle.result
            if result is not None:
                self._recorder.goal_ended(tick, goal.controller, goal.number, result, goal.handle.feedback())
                self._goals.remove(goal)
            elif tick % self._feedback_ticks == 0 and tick < self._next_tick:
                self._recorder.goal_feedback(tick, goal.controller, goal.number, goal.handle.feedback())
