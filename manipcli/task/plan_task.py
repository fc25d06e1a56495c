"""Planning of a whole task before it runs: each step starts at the predicted end of the previous one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from manipcli.control.controllers import CONTROLLERS
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.work import WorkSpent
from manipcli.judge.expectation import labels
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.model.collision import CollisionHit
from manipcli.model.configuration import configuration
from manipcli.plan.candidates import SPENT, Candidates, Dropped, first
from manipcli.plan.claimed_joints import Claims
from manipcli.plan.clearance import StatedClearance, least_clearance, stated_clearances
from manipcli.plan.cost import step_cost
from manipcli.plan.grasp_margin import GraspMargin, grasp_margin
from manipcli.plan.hand import SPEED, closing_speed
from manipcli.plan.motion import Motion, PlanningState, StepPlan
from manipcli.plan.motion_margins import MotionMargins, motion_margins
from manipcli.plan.outline import PlanOutline, StepOutline
from manipcli.plan.part_pairs import expanded_pairs
from manipcli.plan.path_kind import path_kind
from manipcli.plan.planner import Planner
from manipcli.plan.search_budget import SearchBudget
from manipcli.plan.search_progress import SearchProgress
from manipcli.plan.steps import STEPS
from manipcli.plan.task_search import search_task
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.why_not import explained
from manipcli.record.start_state import StartState
from manipcli.simulate.engines import ENGINES
from manipcli.spec.keep import KeepSpec
from manipcli.spec.planner import PlannerSpec
from manipcli.spec.step import StepSpec
from manipcli.task.part import Part
from manipcli.task.restored import restored_start
from manipcli.task.task import Task


@dataclass(frozen=True, slots=True)
class PlannedStep:
    """A step and its plan.

    Attributes:
        id, verb: of the step.
        plan: of its candidate.
        place: file:line:column.
        grasps: excluded tool orientations R_WT (3, 3), after which a later step has no plan.
        candidate: name of the candidate; "" for the only way.
        dropped: the candidates that were tried before it.
        keep: of the step.
    """

    id: str
    verb: str
    plan: StepPlan
    place: str
    grasps: tuple[Array, ...] = ()
    candidate: str = ""
    dropped: tuple[Dropped, ...] = ()
    keep: tuple[KeepSpec, ...] = ()


@dataclass(frozen=True, slots=True)
class PlannedMotion:
    """One motion of one step, for tables and files."""

    step_id: str
    verb: str
    label: str
    trajectory: JointTrajectory | None
    duration: float


@dataclass(frozen=True, slots=True)
class Plan:
    """The plan of a task; steps that the run does not do have no motions.

    `planner` re-plans steps from measured states; `judged`: places of expectations and watches, for the log; `effort`:
    the least `plan: {effort: ...}` with which it is found.
    """

    steps: tuple[PlannedStep, ...]
    start: PlanningState
    planner: Planner
    judged: tuple[str, ...] = ()
    effort: float = 0.0

    @property
    def motions(self) -> tuple[PlannedMotion, ...]:
        """All motions in order."""
        return tuple(
            PlannedMotion(step.id, step.verb, motion.label, motion.trajectory, motion.duration)
            for step in self.steps
            for motion in step.plan.motions
        )

    def spans(self) -> tuple[tuple[Motion, PlanningState, PlanningState], ...]:
        """Each motion with the states before and after it."""
        found: list[tuple[Motion, PlanningState, PlanningState]] = []
        before = self.start
        for step in self.steps:
            found += spans(step.plan.motions, before, step.plan.end)
            before = step.plan.end
        return tuple(found)

    def clearances(self) -> tuple[CollisionHit | None, ...]:
        """The least clearance of each of `motions`: parts, distance and time; None where nothing moves."""
        return tuple(least_clearance(self.planner, motion, end) for motion, _, end in self.spans())

    def stated_clearances(self) -> tuple[StatedClearance, ...]:
        """What the motions keep of each clearance that the task states for a pair."""
        return stated_clearances(self.planner, self.spans())

    def grasps(self) -> tuple[tuple[str, GraspMargin], ...]:
        """Id of each step that ends with an object in the closed hand, and the margin of its grasp."""
        found = ((step.id, grasp_margin(self.planner, step.plan)) for step in self.steps)
        return tuple((id_, margin) for id_, margin in found if margin is not None)

    def margins(self) -> tuple[MotionMargins, ...]:
        """What binds each of `motions`, its margins and its manipulability."""
        keeps = [step.keep for step in self.steps for _ in step.plan.motions]
        return tuple(
            motion_margins(self.planner.keeping(keep), motion, before)
            for keep, (motion, before, _) in zip(keeps, self.spans(), strict=True)
        )

    def path_kinds(self) -> tuple[str, ...]:
        """What the path of each of `motions` is; see `path_kind`."""
        return tuple(path_kind(self.planner, motion, begins) for motion, begins, _ in self.spans())

    @property
    def outline(self) -> PlanOutline:
        """The plan as the log stores it."""
        return PlanOutline(
            tuple(
                StepOutline(step.id, step.verb, step.place, step.plan.duration, step.plan.motions)
                for step in self.steps
            ),
            self.judged,
        )


def unplanned(task: Task) -> Plan:
    """A plan without steps, for pictures of a task that has none: its start and scene."""
    task = task.known
    return Plan(steps=(), start=_start(task), planner=_planner(task))


def plan_task(task: Task, *, on_progress: Callable[[str], None] = lambda _: None, deeper: bool = False) -> Plan:
    """Plans every step. What a sample changes in the simulation only (`Task.truth`) has no effect.

    Args:
        task: the task.
        on_progress: callback with a line for each step and candidate that is tried, see `SearchProgress`.
        deeper: search longer before the task is refused, see `SearchBudget`.

    Raises:
        NotPlannable: names the step and the cause; later steps are not planned.
    """
    task = task.known
    planner = _planner(task)
    start = _start(task)
    if task.part.state is not None:
        start = _resumed(task, planner, start, task.part.state, on_progress)
    judged = tuple(task.log_place(*key) for key in task.spec.judged_at)
    budget = _budget(task, planner, deeper=deeper)
    steps = _steps(task, planner, start, on_progress, budget)
    return Plan(steps, start, planner, judged, effort=task.spec.plan.effort * budget.used)


def spans(
    motions: Sequence[Motion], start: PlanningState, end: PlanningState
) -> tuple[tuple[Motion, PlanningState, PlanningState], ...]:
    """Motions from `start` to `end`, each with the states before and after it; nothing moves where none is known."""
    begins: list[PlanningState] = []
    for motion in motions:
        begins.append(motion.begins or (begins[-1] if begins else start))
    return tuple(zip(motions, begins, (*begins[1:], end), strict=True))


def refused(task: Task, refusal: NotPlannable) -> Verdict:
    """The verdict on a task that did not run because a step cannot be planned."""
    reason = "a step cannot be planned"
    return Verdict(
        task=task.name,
        verdict="failed",
        seed=task.spec.simulation.seed,
        engine=task.spec.simulation.engine,
        simulated_time=0.0,
        steps=tuple(
            StepOutcome(
                id=str(step.id),
                verb=step.verb,
                outcome="failed" if step.id == refusal.step else "not_run",
                started=None,
                ended=None,
                planned_duration=None,
                text=f"cannot be planned: {refusal.cause}" if step.id == refusal.step else "",
            )
            for step in task.spec.steps
        ),
        expectations=tuple(
            ExpectationOutcome(name, "not_evaluated", margin=None, unit="", at=None, text=reason)
            for name in labels(task.spec.judged)
        ),
        errors=refusal.findings,
        text=f"{reason}: {refusal}",
        drawn=task.drawn,
        candidates=refusal.candidates,
        part=task.part.described,
    )


def plan_step(planner: Planner, step: StepSpec, state: PlanningState, grasps: Sequence[Array] = ()) -> StepPlan:
    """Plans one step, excluding `grasps`.

    Raises:
        NotPlannable: with the id of the step.
    """
    try:
        with SearchBudget(planner.kinematics.work).searching():
            return first(_candidates(planner, step, state), exclude=grasps)
    except NotPlannable as refusal:
        raise refusal.but(step=step.id) from refusal
    except WorkSpent:
        raise NotPlannable(SPENT, step=step.id) from None


def _candidates(planner: Planner, step: StepSpec, state: PlanningState) -> Candidates:
    planner = planner.keeping(step.keep)
    if state.at_start:
        planner.outside(state)
    allowed = expanded_pairs(planner.robot, planner.scene, step.allow)
    return STEPS[step.verb].ways(step.body, planner, state, allowed)


def start_position(task: Task) -> Array:
    """Start configuration (n,) [rad or m]: the task's `start` pose, else `home`, else zero clamped to the limits."""
    return configuration(task.robot, task.spec.start)


def _start(task: Task) -> PlanningState:
    return PlanningState(position=start_position(task), bodies=tuple(body.X_WO for body in task.scene.movable))


def _budget(task: Task, planner: Planner, *, deeper: bool = False) -> SearchBudget:
    """The budget of the search: larger where the task asks for more samples of each path."""
    share = task.spec.plan.effort * max(1.0, task.spec.planner.samples / PlannerSpec().samples)
    return SearchBudget(planner.kinematics.work, deeper=deeper, effort=share)


def _resumed(
    task: Task, planner: Planner, start: PlanningState, state: StartState, on_progress: Callable[[str], None]
) -> PlanningState:
    """The state in which a part of the task begins. Without physics, objects are where the steps before it put them in
    the plan: the engine does not move them."""
    if ENGINES[task.spec.simulation.engine].physics == "full":
        return restored_start(state, planner)
    before = replace(task, part=Part(0, task.part.first))
    done = _steps(before, planner, start, on_progress, _budget(task, planner))[: task.part.first]
    ends = [start, *(step.plan.end for step in done)]
    return replace(ends[-1], position=state.position, at_start=False)


def _steps(
    task: Task, planner: Planner, start: PlanningState, on_progress: Callable[[str], None], budget: SearchBudget
) -> tuple[PlannedStep, ...]:
    """Plans the steps of the task's part; see `task_search`."""
    every, part = task.spec.steps, task.part
    first = part.first
    steps = every[first : part.last]

    def located(k: int, refusal: NotPlannable) -> NotPlannable:
        at = task.file.place("steps", first + k, *((steps[k].verb, *refusal.loc) if refusal.loc else ()))
        return refusal.but(step=steps[k].id, place=at)

    def placed(k: int, candidates: Candidates) -> Candidates:
        def further() -> Candidates | None:
            more = candidates.further()
            return None if more is None else placed(k, more)

        return replace(candidates, explain=lambda why: located(k, candidates.explain(why)), further=further)

    def opens(k: int, state: PlanningState) -> Candidates:
        try:
            return placed(k, _candidates(planner, steps[k], state))
        except NotPlannable as refusal:
            raise located(k, refusal) from refusal

    def explain(refusal: NotPlannable, refused: Sequence[tuple[int, Dropped]]) -> NotPlannable:
        handled = {str(step.id): str(getattr(step.body, "object", "")) for step in steps}
        return explained(refusal, [(str(steps[k].id), one) for k, one in refused], handled)

    progress = SearchProgress(on_progress, [str(step.id) for step in steps])
    planner.kinematics.work.doing = progress.doing
    solved = search_task(
        opens,
        len(steps),
        start,
        on_step=progress.step,
        on_candidate=progress.candidate,
        budget=budget,
        explain=explain,
        optimise=task.spec.plan.optimise,
        cost=lambda plan: step_cost(planner, plan).total,
    )
    planned = tuple(
        PlannedStep(
            str(step.id), step.verb, one.chosen.plan, task.log_place("steps", k), one.grasps,
            one.chosen.candidate.name, one.dropped, step.keep,
        )
        for k, (step, one) in enumerate(zip(steps, solved, strict=True), first)
    )  # fmt: skip
    end = planned[-1].plan.end if planned else start
    before, behind = (
        [PlannedStep(str(every[k].id), every[k].verb, StepPlan((), at), task.log_place("steps", k)) for k in range(*of)]
        for at, of in ((start, (0, first)), (end, (first + len(steps), len(every))))
    )
    return (*before, *planned, *behind)


def _planner(task: Task) -> Planner:
    speeds = [
        closing_speed(task.robot, spec.joints, member.hand(spec).speed)
        for spec in task.controllers.controllers.values()
        if (member := CONTROLLERS[spec.type]).hand is not None
    ]
    return Planner(
        task.robot,
        task.scene,
        period=task.spec.simulation.control_period,
        rng=np.random.default_rng(task.spec.simulation.seed),
        gripper_joints=Claims.of(task.controllers).hand,
        gripper_speed=min(speeds, default=SPEED),
        clearance=task.spec.clearance.default,
        clearances={
            frozenset(pair): each.distance
            for each in task.spec.clearance.pairs
            for pair in expanded_pairs(task.robot, task.scene, [each.between])
        },
        paths=task.spec.planner,
    )
