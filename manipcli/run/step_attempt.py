"""One attempt at a step: re-planning, motions, conditions that are waited for, and what must be true at its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

from manipcli.control.action import GoalHandle
from manipcli.core.errors import InvalidArgument, NotPlannable, SimulationFailed
from manipcli.core.stopwatch import Stopwatch
from manipcli.model.collision import Carried
from manipcli.model.grasp import GRIP_FORCE, pinch_force, pressing, squeeze_force
from manipcli.model.state import WorldState
from manipcli.plan.motion import Look, Motion, PlanningState
from manipcli.record.write.recorder import Recorder
from manipcli.run.attaching import Attaching
from manipcli.run.awaited import missing, no_longer, sooner
from manipcli.run.belief import Belief
from manipcli.run.dosing import Dosing
from manipcli.run.grasp_margin import GraspMargin
from manipcli.run.live_conditions import Live, Probe
from manipcli.run.looking import Looking
from manipcli.run.monitors import Monitors
from manipcli.run.observer import Progress
from manipcli.run.pour_watch import PourWatch
from manipcli.run.replan import Measured, after
from manipcli.run.saturation_counts import saturated_since, saturations_of
from manipcli.run.step_results import margin, missed, not_squeezed, result_texts
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.executor import DONE, Alarmed, Executor, Lane, MotionEnd, Until
from manipcli.simulate.session import SLOW, Session
from manipcli.spec.reactions import ReplanSpec
from manipcli.spec.step import StepSpec
from manipcli.task.plan_steps import PlannedStep
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task

DEFAULT_UNTIL_TIME: Final = 30.0
"""[s] Timeout of an `until` on a step without `timeout`."""
OFF_PLAN: Final = "a step before it was re-planned"
SQUEEZED: Final = 0.3
"""[s] Within this time after the hand closed, it presses on its object from opposite sides."""


class StepAttempt:
    """One attempt at a step: re-planned where needed, its motions, and whether it had its effect.

    Attributes:
        failed: whether the next step is re-planned, because one failed before it.
        located: whether a believed pose was corrected since this was last reset: plans made before it do not hold.
        margin: of the last step that ended, and its unit; None where it has none.
        on_phase: called with the name of each motion that begins.

    Args:
        task, plan: to run.
        session: the world, at time 0.
        recorder: receives all events.
        live: evaluates the conditions that steps wait for; receives starts and ends of steps.
        progress: receives steps and unplanned events.
        on_goal: called with every goal, see `Executor`.
        replanning: stopwatch of re-planning.
        belief: about the poses of bodies.
    """

    def __init__(
        self,
        task: Task,
        plan: Plan,
        session: Session,
        recorder: Recorder,
        live: Live,
        progress: Progress,
        *,
        on_goal: Callable[[str, GoalHandle], None],
        replanning: Stopwatch,
        belief: Belief,
    ) -> None:
        self._task = task
        self._live = live
        self._plan = plan
        self._session = session
        self._belief = belief
        self._recorder = recorder
        self._progress = progress
        self._physics = ENGINES[task.spec.simulation.engine].physics == "full"
        self._monitors = Monitors(task.spec.watch, task.spec.expect, live)
        self._executor = Executor(session, touch=self._physics, on_goal=on_goal, alarm=self._look)
        replan = task.spec.replan
        self._replans = replan is not False
        self._guards = any(motion.guarded for step in plan.every for motion in step.plan.motions)
        limits = replan if isinstance(replan, ReplanSpec) else ReplanSpec()
        self._measured = Measured(session, plan.planner, limits, physics=self._physics, belief=belief)
        self._grasp_margin = GraspMargin(task.true.robot, task.true.scene)
        self._believed = plan.start
        self._replanning = replanning
        self.failed = False
        self.margin: tuple[float, str] | None = None
        self.on_phase: Callable[[str], None] = lambda _: None
        self._stopped = ""
        self._open: list[PlannedStep] = []
        self._over = False
        self._at: PlannedStep | None = None
        self._attaching = Attaching(session, self._event)
        self._pour: PourWatch | None = None
        self._looking = Looking(session, plan.planner, belief, recorder)
        self.located = False

    def _look(self, state: WorldState) -> str:
        """At every tick: update the grasp and return the alarm."""
        self._follow(state)
        return self._stopped or (self._alarm(state) if self._task.spec.watch else "")

    def _follow(self, state: WorldState) -> None:
        """Update the grasp."""
        if self._physics and self._session.ticks % SLOW == 0:
            self._measured.grasp.look(self._belief.look(state), self._session.touching)
            if self._pour is not None:
                self._pour.look(state, self._session.touching)
        self._attaching.look(self._at)

    @property
    def may_go_on(self) -> bool:
        """Whether a retry or `on_fail: continue` is possible: not canceled, no broken watch and no controller fault."""
        return not self._over and not self._stopped and not self._session.manager.faults

    def _alarm(self, _: WorldState) -> str:
        """The first broken watch, recorded as an event; "" without one."""
        broken = None if self._over else self._monitors.broken
        if broken is None:
            return ""
        self._over = True
        at = self._at
        self._recorder.event(
            self._session.ticks,
            kind="watch_broken",
            step="" if at is None else at.id,
            verb="" if at is None else at.verb,
            outcome="failed",
            text=broken.text,
            place=self._task.log_place("watch", broken.index),
        )
        return broken.text

    def _attempt(
        self, step: StepSpec, planned: PlannedStep, planned_start: PlanningState, *, retry: bool, limit: float | None
    ) -> Lane[MotionEnd]:
        """One attempt, re-planned on `retry`, after a failed step, or if the measured state differs from the plan."""
        now = self._measured.situation(self._believed)
        if retry and planned_start.carried is None and planned.plan.end.carried is not None:
            now = replace(now, carried=None)  # a retried grasp may start with the hand closed on its object
        differences = self._measured.differences(planned_start, now, step)
        forced = retry or self.failed or self._off_plan(step, planned_start)
        replanned = forced or (self._replans and bool(differences) and planned.plan.depends_on_state)
        if replanned:
            try:
                with self._replanning:
                    plan, now, note = self._measured.plan(step, planned_start, now, planned.grasps)
                poured = plan.poured or planned.plan.poured  # what the cup should hold, even if that is lost
                planned = replace(planned, plan=replace(plan, poured=poured, into=plan.into or planned.plan.into))
            except NotPlannable as refusal:
                self._believed = now
                forced = forced or self._guards
                text = self._measured.refused(planned_start, now, refusal.cause, step, forced=forced)
                return MotionEnd("failed", text)
            why = "; ".join(differences) or (
                "retry" if retry else "the previous step failed" if self.failed else OFF_PLAN
            )
            why += note
            self._event("replanned", planned, "", why)
            self._report(f"re-planned: {why}", detail=True)
            self.failed = False
        found = "" if replanned or not differences else f"; at its start {'; '.join(differences)}"
        return (yield from self._guarded(planned, self._motions(step, planned, now, self._executor, limit), found))

    def _off_plan(self, step: StepSpec, planned_start: PlanningState) -> bool:
        """Whether a step was planned from another end than that of the plan before it, which was a forced re-plan.

        Without it, `replan: false` would jump from the new end to the old one.
        """
        return not self._replans and bool(self._measured.differences(planned_start, self._believed, step))

    def _guarded(self, planned: PlannedStep, motions: Lane[MotionEnd], found: str = "") -> Lane[MotionEnd]:
        """The motions of a step, ended by alarms; a failure also reports what was `found`, and saturated joints."""
        before, plan = saturations_of(self._session), planned.plan
        pour = None
        if plan.poured and plan.end.carried is not None:
            pour = self._pour = PourWatch(self._task.true.scene, plan.end.carried.body, plan.into, plan.poured)
        try:
            end = yield from motions
        except Alarmed as alarm:
            return MotionEnd("failed", f"stopped: {alarm}")
        except InvalidArgument as refused:  # by a controller that a client of a live session has changed
            return MotionEnd("failed", refused.findings[0].message)
        except SimulationFailed as failure:
            text = str(failure) + saturated_since(before, self._session)
            self._event("step_ended", planned, "failed", text)
            raise
        finally:
            if pour is not None:
                self._pour = None
        if end.outcome == "done":
            return end if pour is None else replace(end, text=pour.with_times(end.text))
        flown = "" if pour is None or not pour.text() else f"; {pour.text()}"
        return MotionEnd(end.outcome, end.text + flown + found + saturated_since(before, self._session))

    def _motions(
        self, step: StepSpec, planned: PlannedStep, before: PlanningState, executor: Executor, limit: float | None
    ) -> Lane[MotionEnd]:
        """All motions of the plan, which starts in `before`, and the wait for `until`; both up to `limit` [s]."""
        deadline = sooner(None if step.timeout is None else self._session.time + step.timeout, limit)
        if before.carried is not None and self._physics:
            self._measured.grasp.begin_step(before.carried, self._state, self._session.touching)
        texts = []
        dosing = Dosing.of(self._plan.planner, planned.plan, self._pour, self._measured.situation)
        with self._awaited(step) as probe:
            until: Until | None = None if probe is None else lambda _: probe.holds
            awaited = until is not None
            for k, motion in enumerate(planned.plan.motions):
                self._event("phase_started", planned, "", motion.label)
                self._believed = after(planned.plan, before, done=k)
                if motion.opens and before.carried is not None and k > 0:
                    left = self._left_behind(before.carried)
                    if left is not None:
                        return left
                if motion.opens or motion.lets_go:
                    self._belief.let_go(self._state)
                self._attaching.before(motion, planned)
                over = deadline
                if motion.awaits and until is not None and step.timeout is None:
                    over = sooner(over, self._session.time + motion.duration + DEFAULT_UNTIL_TIME)
                if motion.looks is not None:
                    end = yield from self._look_at(motion.looks, planned, over)
                elif dosing is not None:
                    end = yield from dosing.running(motion, executor, over)
                else:
                    end = yield from executor.running(motion, until=until, deadline=over)
                if end.outcome != "done":
                    held = self._still_held(before) if motion.grip is not None and motion.grip.must_arrive else ""
                    text = f"{motion.label}: {end.text}{missing(end, probe)}{f'; {held}' if held else ''}"
                    return MotionEnd(end.outcome, text)
                missed = self._attaching.after(motion, planned)
                if missed:
                    return MotionEnd("failed", missed)
                if motion.closes and planned.plan.end.carried is not None:
                    self._grasp_margin.taken(planned.plan.end.carried.body, self._session.touching)
                    self._take(planned.plan.end.carried)
                    if loose := (yield from self._loose(motion, planned.plan.end.carried.body)):
                        self._belief.let_go(self._state)
                        return MotionEnd("failed", f"{motion.label}: {loose}: {end.text}")
                if end.weak:
                    self._report(f"{motion.label}: {end.text}", detail=False)
                awaited = awaited and (dosing is not None or not motion.awaits)
                texts += [end.text + no_longer(motion, probe)] if end.text else []
            self._believed = self._looking.corrected(planned.plan)
            if awaited and until is not None:
                if step.timeout is None:
                    deadline = sooner(deadline, self._session.time + DEFAULT_UNTIL_TIME)
                end = yield from executor.waiting(until, deadline=deadline or 0.0)
                if end.outcome != "done":
                    return replace(end, text=end.text + missing(end, probe))
        held = self._still_held(before) if planned.plan.end.carried is None else ""
        if held:
            return MotionEnd("failed", held)
        if planned.plan.end.carried is None:
            self._measured.grasp.release()
        left = self._left_behind(planned.plan.end.carried) or self._short_of_plan(planned, before)
        left = left or self._without_result(step, planned)
        situation = self._measured.situation if self._physics else None
        texts = [*result_texts(self._plan.planner, planned.plan, situation), *texts]
        return left or (MotionEnd("done", "; ".join(texts)) if texts else DONE)

    def _look_at(self, looks: Look, planned: PlannedStep, deadline: float | None) -> Lane[MotionEnd]:
        """Locate a body; its believed pose is then corrected and recorded."""
        found = yield from self._looking.look(looks, lambda: self._measured.situation(self._believed), deadline)
        if found.failure:
            return MotionEnd("failed", found.failure)
        self.located = True
        self._event("located", planned, looks.object, found.text)
        self._report(found.text, detail=False)
        yield  # the last tick of the step has the corrected belief
        return MotionEnd("done", found.text)

    @contextmanager
    def _awaited(self, step: StepSpec) -> Iterator[Probe | None]:
        """The open probe of the step's `until`; None without `until`, or if the engine cannot evaluate it."""
        if step.until is None or self._live.absent(step.until) is not None:
            yield None
            return
        probe = self._live.open(step.until)
        try:
            yield probe
        finally:
            self.margin = probe.margin
            self._live.close(probe)

    def _take(self, carried: Carried) -> None:
        """The hand has closed on an object."""
        if self._physics:
            self._belief.hold(carried, self._state)
            self._measured.grasp.close(carried, self._state, self._session.touching)

    def _loose(self, motion: Motion, body: str) -> Lane[str]:
        """Why the closed hand does not hold an object, up to `SQUEEZED` after it closed; "" where it does."""
        if not self._physics or motion.grip is None or not motion.grip.must_hold or self._attaching.holding is not None:
            return ""

        def squeezed(_: object) -> bool:
            return squeeze_force(self._session.touching, body) >= GRIP_FORCE

        if squeezed(None):
            return ""
        end = yield from self._executor.waiting(squeezed, deadline=self._session.time + SQUEEZED)
        if end.outcome == "done":
            return ""
        return not_squeezed(self._session.touching, body)

    def _left_behind(self, carried: Carried | None) -> MotionEnd | None:
        """A failure if the hand does not carry the planned object; None if it does."""
        if carried is None or not self._physics:
            return None
        why = self._measured.grasp.lost(carried, self._state, self._session.touching)
        if not why:
            return None
        self._belief.let_go(self._state)
        text = f"the hand does not carry '{carried.body}': {why}"
        if self._attaching.holding is not None:
            return MotionEnd("failed", text)
        grasp = self._grasp_margin.summary(carried.body)
        text += "; it slipped or was never held"
        return MotionEnd("failed", f"{text}{f'; {grasp}' if grasp else ''}")

    def _short_of_plan(self, planned: PlannedStep, before: PlanningState) -> MotionEnd | None:
        """A failure where the object in the hand did not follow the planned motion; a guarded step may end early."""
        carried, end = before.carried, planned.plan.end
        if carried is None or end.carried is None or not self._physics:
            return None
        if any(motion.guarded for motion in planned.plan.motions):
            return None
        planner = self._plan.planner
        motion = planner.tool_pose(end).p - planner.tool_pose(before).p
        why = self._measured.grasp.short_of(motion, self._state)
        return MotionEnd("failed", f"'{carried.body}' did not follow the hand: {why}") if why else None

    def _without_result(self, step: StepSpec, planned: PlannedStep) -> MotionEnd | None:
        """A failure where an object is not where the step puts or pours it; `until` may define another pour."""
        plan, planner = planned.plan, self._plan.planner
        if not self._physics or not (plan.placed or plan.poured or plan.joint or plan.inserted):
            return None
        now = self._measured.situation(replace(plan.end, carried=None))
        why = missed(planner, plan, now, poured=step.until is None)
        return MotionEnd("failed", why) if why else None

    def _still_held(self, before: PlanningState) -> str:
        """Which links still hold the object that was carried `before`; "" if it was released."""
        if before.carried is None or not self._physics:
            return ""
        body = before.carried.body
        if pinch_force(self._session.touching, body) < GRIP_FORCE:
            return ""
        self._believed = replace(self._believed, carried=before.carried, closed=before.closed)
        self._belief.hold(before.carried, self._state)
        (_, first), (_, second), *_ = pressing(self._session.touching, body)
        return f"the hand still holds '{body}', between '{first}' and '{second}'"

    @property
    def _state(self) -> WorldState:
        """The state now, as the robot believes it."""
        return self._belief.look(self._session.engine.read())

    def _report(self, text: str, *, detail: bool) -> None:
        self._progress.message(text, detail=detail)

    def _margin_of(self, planned: PlannedStep) -> tuple[float, str] | None:
        """By how much a step that is done was done: to the limit of its place, or the load that its grasp can hold."""
        plan = planned.plan
        if not self._physics:
            return None
        if plan.placed or plan.joint is not None:
            return margin(self._plan.planner, plan, self._measured.situation(replace(plan.end, carried=None)))
        if plan.end.carried is None or planned.start.carried is not None:
            return None
        spare = self._grasp_margin.spare(plan.end.carried.body)
        return None if spare is None else (spare, "N")

    def _event(self, kind: str, step: PlannedStep, outcome: str, text: str) -> None:
        if kind == "phase_started":
            self.on_phase(text)
        elif kind == "step_started":
            self._open.append(step)
        elif kind == "step_ended":
            self._open = [each for each in self._open if each.index != step.index]
        self._recorder.event(
            self._session.ticks, kind=kind, step=step.id, verb=step.verb, outcome=outcome, text=text, place=step.place
        )
