"""Steps of a running task: attempts, two steps at once, choices and waits; `blocks` decides what comes next."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final

from manipcli.control.roles import has_reflex
from manipcli.core.errors import NotPlannable
from manipcli.judge.verdict import StepOutcome, StepWord
from manipcli.plan.block_tree import Unit
from manipcli.plan.motion import PlanningState
from manipcli.run.awaited import missing
from manipcli.run.effort_shortage import effort_shortage
from manipcli.run.monitors import Monitors
from manipcli.run.restore import RESUMED
from manipcli.run.step_attempt import DEFAULT_UNTIL_TIME, OFF_PLAN, StepAttempt
from manipcli.simulate.executor import DONE, Alarmed, Lane, MotionEnd
from manipcli.spec.condition import ConditionSpec
from manipcli.spec.retry import retried
from manipcli.spec.step import StepSpec
from manipcli.task.plan_steps import PlannedStep, plan_units
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task

ASKED: Final = 0.2
"""[s] The robot holds still for this time before a choice; its condition counts at the end of it."""
AFTERMATH: Final = 0.6
"""[s] Simulated after the last step, so that `at_rest` can be judged."""


class StepLoop(StepAttempt):
    """Does single steps and pairs of steps; see `StepAttempt` for the arguments."""

    def resume(self, first: PlannedStep) -> None:
        """Before the `first` step of a part of a task that begins in a recorded state: let the forces return."""
        if self._task.part.state is None:
            return
        self._attaching.resumed(first)
        with suppress(Alarmed):
            self._executor.hold(RESUMED)

    def turn_to(self, task: Task, plan: Plan) -> None:
        """Do the steps of another task with the same robot and scene from now on; the world and the grasp stay."""
        self.stop_watching()
        self._monitors = Monitors(task.spec.watch, task.spec.expect, self._live)
        self._task, self._plan, self._replans = task, plan, task.spec.replan is not False
        self._over, self._stopped = False, ""

    def stop_watching(self) -> None:
        """End the watches of the task."""
        self._monitors.close()

    def rest(self) -> None:
        """One tick between steps."""
        self._follow(self._session.tick())

    def cancel(self, why: str) -> None:
        """End the running step after this tick, and stop the robot."""
        self._stopped = why

    def abandon(self, why: str) -> None:
        """The simulation ends now: record that the running steps are interrupted."""
        for planned in [*self._open]:
            self._event("step_ended", planned, "interrupted", why)

    def step(self, planned: PlannedStep, limit: float | None = None) -> StepOutcome:
        """All attempts at a step. A broken watch ends the step at once; the stopping motion follows the step.

        Args:
            planned: the step.
            limit: [s] simulated time at which it times out, besides its own `timeout`; None without one.
        """
        index = planned.index
        step = self._task.spec.steps[index]
        self._progress.step_started(planned, index, len(self._task.spec.steps))
        planned_start = planned.start
        began = ended = self._session.time
        retry = step.retry
        attempts = 1 if retry is None else 1 + retry.retry
        end = DONE
        self.margin = None
        self._begin(planned)
        for attempt in range(1, attempts + 1):
            if attempt > 1:
                changed = retried(self._task.file, index)
                if changed != step:
                    planned = replace(planned, grasps=())  # they belong to the unchanged step
                step = changed
            self._event("step_started", planned, "", self._nth(step, attempt, attempts))
            lane = self._attempt(step, planned, planned_start, retry=attempt > 1, limit=limit)
            (end,) = self._executor.together(lane)
            last = attempt == attempts or self.over(limit)
            if end.outcome == "done" or last or not self.may_go_on:
                end = self._closed(planned, end)
            ended = self._session.time
            end = self._ended(planned, end)
            if end.outcome == "done" or not self.may_go_on:
                break
            self.failed = True
            if not last:
                self._report(f"{end.outcome}: {end.text}; retrying", detail=False)
            if not last or step.may_fail:
                self._executor.stop()
            if last:
                break
        if self.margin is None and end.outcome == "done":
            self.margin = self._margin_of(planned)
        return self._outcome(step, planned, began, ended, end)

    def pair(self, both: Sequence[PlannedStep], limit: float | None = None) -> tuple[StepOutcome, ...]:
        """Two steps at the same time, each with one attempt; both end before this returns."""
        steps = [self._task.spec.steps[planned.index] for planned in both]
        began, now = self._session.time, self._measured.situation(self._believed)
        differences = self._measured.differences(both[0].start, now, steps[0])
        forced = self.failed or self._off_plan(steps[0], both[0].start)
        reason = "the previous step failed" if self.failed else OFF_PLAN
        refusal, replanned = "", forced or (self._replans and bool(differences))
        if replanned:
            try:
                both = self.planned([tuple(planned.index for planned in both)], now)
            except NotPlannable as refused:
                refusal = f"re-planning from the measured state failed: {refused}"
        for planned in both:
            self._progress.step_started(planned, planned.index, len(self._task.spec.steps))
            self._begin(planned)
            self._event("step_started", planned, "", "")
            if replanned:
                self._event("replanned", planned, "", "; ".join(differences) or reason)
        self.failed = False

        def lane(k: int) -> Lane[tuple[MotionEnd, float]]:
            executor = self._executor.beside if k else self._executor
            if refusal:
                end = MotionEnd("failed", refusal)
            else:
                end = yield from self._guarded(both[k], self._motions(steps[k], both[k], now, executor, limit))
            end = self._ended(both[k], self._closed(both[k], end))
            return end, self._session.time

        ends = self._executor.together(*map(lane, range(len(both))))
        if all(end.outcome == "done" for end, _ in ends):
            self._believed = both[0].plan.end
        else:
            self.failed = True
            self._executor.stop()
        return tuple(
            self._outcome(step, planned, began, at, end)
            for step, planned, (end, at) in zip(steps, both, ends, strict=True)
        )

    def ask(self, condition: ConditionSpec) -> tuple[bool, str] | MotionEnd:
        """Whether a condition holds while the robot rests, with its margin and what was measured; or why not asked."""
        absent = self._live.absent(condition)
        if absent is not None:
            return MotionEnd("failed", f"the condition cannot be evaluated: {absent}")
        probe = self._live.open(condition)
        try:
            self._executor.hold(ASKED)
            return probe.holds, probe.found
        except Alarmed as alarm:
            self._executor.stop()
            return MotionEnd("failed", f"stopped: {alarm}")
        finally:
            self._live.close(probe)

    def wait(self, condition: ConditionSpec, limit: float | None) -> MotionEnd:
        """Wait until a condition holds, for `DEFAULT_UNTIL_TIME` or until `limit` [s]."""
        if self._live.absent(condition) is not None:
            return DONE
        probe = self._live.open(condition)
        try:
            deadline = self._session.time + DEFAULT_UNTIL_TIME if limit is None else limit
            end = self._executor.wait(lambda _: probe.holds, deadline=deadline)
            return end if end.outcome == "done" else replace(end, text=end.text + missing(end, probe))
        except Alarmed as alarm:
            self._executor.stop()
            return MotionEnd("failed", f"stopped: {alarm}")
        finally:
            self._live.close(probe)

    def planned(self, units: Sequence[Unit], now: PlanningState | None = None) -> tuple[PlannedStep, ...]:
        """Steps planned together from the measured state.

        Raises:
            NotPlannable: one of them has no plan.
        """
        with self._replanning:
            now = self._measured.situation(self._believed) if now is None else now
            solved = plan_units(self._task.known, self._plan.planner, units, now)
        self.failed = False
        return tuple(step for steps in solved.steps for step in steps)

    def over(self, limit: float | None) -> bool:
        """Whether a time limit [s] is reached."""
        return limit is not None and self._session.time >= limit

    def stop(self) -> None:
        """Bring the robot to rest after a failure; the next step is re-planned."""
        self.failed = True
        self._executor.stop()

    def begin_again(self, indices: Sequence[int]) -> None:
        """These steps are not done yet in the next attempt at their block."""
        for index in indices:
            self._live.step_reset(str(self._task.spec.steps[index].id), skipped=False)

    def let_go(self) -> bool:
        """Plan from now on as if the hand held nothing; whether it held something."""
        held = self._believed.carried is not None
        self._believed = replace(self._believed, carried=None)
        return held

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._session.time

    def block_event(self, kind: str, index: int, outcome: str, text: str) -> None:
        """Record an event of a block, and show the branch that is taken."""
        block = self._task.spec.blocks[index]
        self._recorder.event(
            self._session.ticks, kind=kind, step=block.id, verb=block.word, outcome=outcome, text=text,
            place=self._task.log_place("blocks", index),
        )  # fmt: skip
        if kind == "branch" or (kind == "block_ended" and outcome != "done" and text):
            self._report(f"{block.id}: {outcome}: {text}", detail=False)

    def skipped(self, index: int, reason: str) -> StepOutcome:
        """A step of the branch that is not taken."""
        self._live.step_reset(str(self._task.spec.steps[index].id), skipped=True)
        return self._unreached(index, "step_skipped", "skipped", reason)

    def tolerated(self, index: int, reason: str) -> None:
        """A step that failed or was not reached, and whose block tolerates that."""
        self._unreached(index, "step_tolerated", "", reason)

    def refused(self, index: int, reason: str) -> StepOutcome:
        """A step that has no plan when it is reached."""
        step = self._task.spec.steps[index]
        self._live.step_started(str(step.id))
        self._unreached(index, "step_started", "", "")
        outcome = self._unreached(index, "step_ended", "failed", f"no plan from the measured state: {reason}")
        self._live.step_ended(str(step.id), "failed")
        if step.may_fail:
            self.tolerated(index, "on_fail: continue")
            outcome = replace(outcome, tolerated=True)
        self.stop()
        self._progress.step_ended(outcome)
        return outcome

    def _unreached(self, index: int, kind: str, outcome: str, text: str) -> StepOutcome:
        """Record an event of a step without a plan."""
        step, now = self._task.spec.steps[index], self._session.time
        self._recorder.event(
            self._session.ticks, kind=kind, step=str(step.id), verb=step.verb, outcome=outcome, text=text,
            place=self._task.log_place("steps", index),
        )  # fmt: skip
        word: StepWord = "skipped" if outcome == "skipped" else "failed"
        return StepOutcome(str(step.id), step.verb, word, now, now, None, text)

    def finish(self) -> None:
        """The time after the last step."""
        self._at = None
        try:
            self._executor.hold(AFTERMATH)
        except Alarmed:
            self._executor.stop()

    def _begin(self, planned: PlannedStep) -> None:
        self._at = planned
        self._live.step_started(planned.id)
        self._monitors.step_started(planned.id)
        if planned.plan.duration != self._plan.listed[planned.index].planned_duration:
            self._event("step_planned", planned, "", repr(planned.plan.duration))

    def _ended(self, planned: PlannedStep, end: MotionEnd) -> MotionEnd:
        """The end of an attempt, recorded; with what a reflex did, and the joints that lack effort if it failed."""
        if end.outcome != "done" and self._physics:
            short = effort_shortage(self._session, self._task.scene.gravity)
            end = replace(end, text=f"{short}; {end.text}") if short else end
        for controller in self._session.manager.controllers:
            if has_reflex(controller) and (pressed := controller.reflex.report()):
                self._report(pressed, detail=False)
                end = replace(end, text=f"{end.text}; {pressed}" if end.text else pressed)
        self._event("step_ended", planned, end.outcome, end.text)
        return end

    def _outcome(self, step: StepSpec, planned: PlannedStep, began: float, ended: float, end: MotionEnd) -> StepOutcome:
        if self._over or self._stopped:
            self._executor.stop()
        tolerated = end.outcome != "done" and step.may_fail and self.may_go_on
        if tolerated:
            self._event("step_tolerated", planned, "", "on_fail: continue")
        outcome = StepOutcome(
            id=planned.id,
            verb=planned.verb,
            outcome=end.outcome,
            started=began,
            ended=ended,
            planned_duration=planned.plan.duration,
            text=end.text,
            tolerated=tolerated,
        )
        self._progress.step_ended(outcome)
        return outcome

    def _closed(self, planned: PlannedStep, end: MotionEnd) -> MotionEnd:
        """The end of a step; a failure if its last ticks, which are evaluated only now, break a watch."""
        self._live.step_ended(planned.id, end.outcome)
        self._monitors.step_ended(planned.id)
        broken = self._alarm(self._session.state)
        if not broken:
            return end
        self._live.step_ended(planned.id, "failed")
        before = f"; before that: {end.outcome}: {end.text}" if end.outcome != "done" else ""
        return MotionEnd("failed", f"stopped: {broken}{before}")

    def _nth(self, step: StepSpec, attempt: int, attempts: int) -> str:
        """`attempt 2 of 3, with tilt = 140 deg`; "" if there is only one attempt."""
        if attempts == 1:
            return ""
        changed = {} if step.retry is None or attempt == 1 else step.retry.with_
        values = ", ".join(f"{name} = {value}" for name, value in changed.items())
        return f"attempt {attempt} of {attempts}{f', with {values}' if values else ''}"
