"""Plans of successive steps of a task: searched together, each from the predicted end of the one before."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.work import WorkSpent
from manipcli.plan.block_tree import Unit
from manipcli.plan.branches import Solved
from manipcli.plan.candidates import SPENT, Candidates, Dropped, first
from manipcli.plan.cost import step_cost
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.parallel import beside
from manipcli.plan.part_pairs import expanded_pairs
from manipcli.plan.planner import Planner
from manipcli.plan.search_budget import SearchBudget
from manipcli.plan.search_progress import SearchProgress
from manipcli.plan.steps import STEPS
from manipcli.plan.task_search import search_task
from manipcli.plan.why_not import explained
from manipcli.spec.keep import KeepSpec
from manipcli.spec.step import StepSpec
from manipcli.task.task import Task


@dataclass(frozen=True, slots=True)
class PlannedStep:
    """A step and its plan.

    Attributes:
        id, verb: of the step.
        plan: of its candidate.
        place: file:line:column.
        start: the state that it is planned from.
        index: in the task.
        grasps: excluded tool orientations R_WT (3, 3), after which a later step has no plan.
        candidate: name of the candidate; "" for the only way.
        dropped: the candidates that were tried before it.
        keep: of the step.
        beside: it is done at the same time as the step before.
    """

    id: str
    verb: str
    plan: StepPlan
    place: str
    start: PlanningState
    index: int
    grasps: tuple[Array, ...] = ()
    candidate: str = ""
    dropped: tuple[Dropped, ...] = ()
    keep: tuple[KeepSpec, ...] = ()
    beside: bool = False


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


def plan_units(
    task: Task,
    planner: Planner,
    units: Sequence[Unit],
    start: PlanningState,
    *,
    on_progress: Callable[[str], None] = lambda _: None,
    branch: Callable[[int], str] = lambda _: "",
    budget: SearchBudget | None = None,
) -> Solved[PlannedStep]:
    """Plans steps together, see `task_search`.

    Args:
        task: of the steps.
        planner: of the task.
        units: indices of the steps; those of a unit are done at the same time.
        start: predicted or measured.
        on_progress: callback with a line for each step and candidate that is tried.
        branch: the outcomes of the choices before the step of an index, for these lines.
        budget: of the search; None: the usual one.

    Raises:
        NotPlannable: names the step and the cause.
    """
    steps = task.spec.steps

    def located(k: int, refusal: NotPlannable) -> NotPlannable:
        at = task.file.place("steps", k, *((steps[k].verb, *refusal.loc) if refusal.loc else ()))
        return refusal.but(step=steps[k].id, place=at)

    def placed(k: int, candidates: Candidates) -> Candidates:
        def further() -> Candidates | None:
            more = candidates.further()
            return None if more is None else placed(k, more)

        return replace(candidates, explain=lambda why: located(k, candidates.explain(why)), further=further)

    def hand_of(unit: Unit) -> int | None:
        """The step of a `parallel` that moves the hand."""
        parts = {k: STEPS[steps[k].verb].part(steps[k].body, planner.robot, planner.gripper_joints) for k in unit}
        return next((k for k in unit if parts[k] == "hand"), unit[-1]) if len(unit) > 1 else None

    def opens(n: int, state: PlanningState) -> Candidates:
        hand = hand_of(units[n])
        (k,) = (k for k in units[n] if k != hand)
        try:
            candidates = _candidates(planner, steps[k], state)
            if hand is not None:
                candidates = beside(planner, candidates, plan_of(hand, state), state)
            return placed(k, candidates)
        except NotPlannable as refusal:
            raise (refusal if refusal.step else located(k, refusal)) from refusal

    def plan_of(k: int, state: PlanningState) -> StepPlan:
        try:
            return first(_candidates(planner, steps[k], state))
        except NotPlannable as refusal:
            raise located(k, refusal) from refusal

    def explain(refusal: NotPlannable, refused: Sequence[tuple[int, Dropped]]) -> NotPlannable:
        handled = {str(step.id): str(getattr(step.body, "object", "")) for step in steps}
        return explained(refusal, [(str(steps[units[n][0]].id), one) for n, one in refused], handled)

    progress = SearchProgress(on_progress, [str(step.id) for step in steps], branch)
    planner.kinematics.work.doing = progress.doing
    solved = search_task(
        opens,
        len(units),
        start,
        on_step=lambda n, again: progress.step(units[n][0], again),
        on_candidate=progress.candidate,
        budget=budget or SearchBudget(planner.kinematics.work),
        explain=explain,
        optimise=task.spec.plan.optimise,
        cost=lambda plan: step_cost(planner, plan).total,
    )
    found: list[tuple[PlannedStep, ...]] = []
    before = start
    for unit, one in zip(units, solved, strict=True):
        hand, plan = hand_of(unit), one.chosen.plan
        found.append(
            tuple(
                PlannedStep(
                    str(steps[k].id), steps[k].verb, plan, task.log_place("steps", k), before, k, one.grasps,
                    one.chosen.candidate.name, one.dropped, steps[k].keep, k != unit[0],
                )
                if k != hand
                else PlannedStep(
                    str(steps[k].id), steps[k].verb, replace(plan_of(k, before), end=plan.end),
                    task.log_place("steps", k), before, k, beside=k != unit[0],
                )
                for k in unit
            )
        )  # fmt: skip
        before = plan.end
    return Solved(tuple(found), tuple(one.chosen.plan.end for one in solved))
