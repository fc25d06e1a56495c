"""Steps in a live session: those of its task, and those that clients ask for, one at a time.

A step is planned from the measured state between two ticks; simulated time stops meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Literal

from manipcli.control.compliant_arm import complies, replaced
from manipcli.control.roles import is_follower
from manipcli.core.errors import InvalidInput, NotPlannable, SimulationFailed
from manipcli.core.stopwatch import Stopwatch
from manipcli.judge.steps import STEPS_ENDED
from manipcli.live.pace import Pace
from manipcli.plan.claimed_joints import Claims
from manipcli.record.write.recorder import Recorder
from manipcli.run.blocks import BlockLoop
from manipcli.run.live_conditions import Live
from manipcli.run.observer import Observer, Progress
from manipcli.run.step_loop import StepLoop
from manipcli.simulate.session import Session
from manipcli.task.felt import felt
from manipcli.task.lone_step import lone_plan, lone_step
from manipcli.task.plan_steps import PlannedStep
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task

CANCELED: Final = "canceled by the client"
TASK: Final = "the steps of the task"

Outcome = Literal["done", "failed", "timeout", "canceled", "not_plannable", "invalid", "rejected"]


@dataclass(frozen=True, slots=True)
class StepEnd:
    """How a step of a client ended; `margin`: by how much, and its unit, None without one."""

    outcome: Outcome
    text: str = ""
    margin: tuple[float, str] | None = None


@dataclass(frozen=True, slots=True)
class Checked:
    """Whether a step can be done now; `refused`: how it would end, None if it is planned."""

    refused: StepEnd | None
    planned: PlannedStep | None = None


@dataclass(slots=True)
class StepRequest:
    """A step of a client.

    Attributes:
        id: of the step in the log; "" if it is refused.
        task: with this step alone; None if it is not valid.
        on_phase: called with the name of each motion that begins, and with `plan` before.
        end: how it ended; None before.
        canceled: the client does not want it any more.
    """

    id: str
    task: Task | None
    on_phase: Callable[[str], None] = field(default=lambda _: None)
    end: StepEnd | None = None
    canceled: bool = False

    def is_wanted(self) -> bool:
        """Whether the client has not canceled it."""
        return not self.canceled


class _Planning(Stopwatch):
    """Wall time of planning, which the pace does not catch up."""

    def __init__(self, pace: Pace) -> None:
        super().__init__()
        self._pace = pace

    def __exit__(self, *raised: object) -> None:
        super().__exit__(None, None, None)
        self._pace.start()


class LiveSteps:
    """Does steps in a session.

    Args:
        task, plan: of the session.
        session, recorder, live, observer, pace: see `simulate_live`.
        progress: receives the steps.
    """

    def __init__(
        self,
        task: Task,
        plan: Plan,
        session: Session,
        recorder: Recorder,
        live: Live,
        observer: Observer,
        progress: Progress,
        pace: Pace,
    ) -> None:
        self._task, self._plan, self._session = task, plan, session
        self._recorder, self._live, self._observer, self._progress = recorder, live, observer, progress
        self._loop: StepLoop | None = None
        self._waiting: StepRequest | None = None
        self._current: StepRequest | None = None
        self._doing = ""
        self._count = 0
        self.planning = _Planning(pace)

    def run(self) -> None:
        """Do the steps of the task."""
        self._doing = TASK
        loop = self._loop_of(self._task, self._plan)
        BlockLoop(self._plan, loop).run()
        loop.stop_watching()
        self._doing = ""
        text = "the controllers hold"
        self._recorder.event(self._session.ticks, kind=STEPS_ENDED, step="", verb="", outcome="", text=text, place="")

    def rest(self) -> None:
        """One tick between steps, and a step that was asked for in it."""
        if self._loop is None:
            self._session.tick()
        else:
            self._loop.rest()
        request = self._waiting
        if request is not None:
            self._waiting = None
            request.end = self._done(request)
            self._current, self._doing = None, ""

    def abandon(self, why: str) -> None:
        """The session is over: record that a running step is not done."""
        if self._loop is not None:
            self._loop.abandon(why)
        if self._current is not None:
            self._current.end = StepEnd("failed", why)

    def request(self, text: str, on_phase: Callable[[str], None]) -> StepRequest:
        """Do a step after this tick, if it is valid and the robot rests.

        Args:
            text: of the step, see `lone_step`.
            on_phase: see `StepRequest`.
        """
        found = self._checked(text)
        if found.end is None and found.task is not None:
            found.id, found.on_phase = str(found.task.spec.steps[0].id), on_phase
            self._count += 1
            self._waiting = self._current = found
            self._doing = f"step '{found.id}'"
        return found

    def cancel(self, request: StepRequest) -> None:
        """End a step; the robot stops."""
        request.canceled = True
        if self._loop is not None and request is not self._waiting and request.end is None:
            self._loop.cancel(CANCELED)

    def check(self, text: str) -> Checked:
        """Plan a step from the measured state, and do nothing."""
        found = self._checked(text)
        if found.end is not None or found.task is None:
            return Checked(found.end)
        with self.planning:
            plan = self._planned(found.task)
        return Checked(plan) if isinstance(plan, StepEnd) else Checked(None, plan)

    def _checked(self, text: str) -> StepRequest:
        """A request that can be planned; else one with its end."""
        try:
            task = lone_step(text, self._task, self._count + 1, self._claims)
        except InvalidInput as invalid:
            findings = [f"{finding}; {finding.hint}" if finding.hint else str(finding) for finding in invalid.findings]
            return StepRequest("", None, end=StepEnd("invalid", "\n".join(findings)))
        request = StepRequest("", task)
        if uncompliant := self._uncompliant(task):
            request.end = StepEnd("invalid", uncompliant)
        elif self._doing:
            request.end = StepEnd("rejected", f"{self._doing} is running; cancel it, or wait for its result")
        elif moving := self._moving:
            request.end = StepEnd("rejected", f"controller '{moving}' moves; cancel its goal, or wait for its result")
        return request

    def _uncompliant(self, task: Task) -> str:
        """Why the arm cannot comply in the step of a task; "" where it can, or need not."""
        controllers = self._session.manager.controllers
        if not felt(task.spec) or self._session.engine.ideal or any(map(complies, controllers)):
            return ""
        return "the arm has no compliant controller, as no step of the session's task is compliant; add one to it"

    @property
    def _claims(self) -> Claims:
        """The controllers as they are now; those that a compliant one replaces return before the next motion."""
        claims, manager = Claims.of(self._task.controllers), self._session.manager
        every, returning = [claim.name for claim in claims.controllers], replaced(manager.controllers)
        return claims.switched([name for name in every if manager.is_active(name) or name in returning], every)

    @property
    def _moving(self) -> str:
        """The controller whose reference moves; "" while the robot rests."""
        manager = self._session.manager
        for controller, output in zip(manager.controllers, manager.outputs, strict=True):
            if manager.started and output is not None and is_follower(controller) and output.velocity.any():
                return controller.name
        return ""

    def _done(self, request: StepRequest) -> StepEnd:
        task = request.task
        if task is None or not request.is_wanted():
            return StepEnd("canceled", CANCELED)
        request.on_phase("plan")
        plan = self._planned(task)
        if isinstance(plan, StepEnd):
            what = f"step '{request.id}' has no plan: {plan.text}"
            self._recorder.event(
                self._session.ticks, kind="refused", step="", verb="", outcome="error", text=what, place=""
            )
            return plan
        assert self._loop is not None  # it has planned
        self._loop.on_phase = request.on_phase
        outcome = self._loop.step(plan)
        self._loop.stop_watching()
        if not request.is_wanted() and outcome.outcome != "done":
            return StepEnd("canceled", outcome.text)
        word: Outcome = "done" if outcome.outcome == "done" else "timeout" if outcome.outcome == "timeout" else "failed"
        return StepEnd(word, outcome.text, self._loop.margin)

    def _planned(self, task: Task) -> PlannedStep | StepEnd:
        loop = self._loop_of(task, lone_plan(task, self._plan.start, self._plan.planner))
        try:
            return loop.planned([(0,)])[0]
        except NotPlannable as refusal:
            return StepEnd("not_plannable", f"{refusal.cause}; {refusal.hint}" if refusal.hint else refusal.cause)
        except SimulationFailed:
            raise
        except Exception as error:  # noqa: BLE001
            # A step that no check foresaw must not end the session of the others.
            return StepEnd("not_plannable", f"{type(error).__name__}: {error}")

    def _loop_of(self, task: Task, plan: Plan) -> StepLoop:
        """The loop for this task; the first one is made here, later ones know what the hand holds."""
        if self._loop is None:
            self._loop = StepLoop(
                task, plan, self._session, self._recorder, self._live, self._progress, on_goal=self._observer.goal,
                replanning=self.planning, belief=self._observer.belief,
            )  # fmt: skip
        else:
            self._loop.turn_to(task, plan)
        return self._loop
