"""Planning of a whole task before it runs: each step starts at the predicted end of the previous one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from manipcli.control.controllers import CONTROLLERS
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.judge.expectation import labels
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.model.collision import CollisionHit
from manipcli.model.configuration import configuration
from manipcli.plan.block_tree import Item, Outcomes, Unit, block_tree, clipped, named, stretch
from manipcli.plan.branches import Solved, plan_branches
from manipcli.plan.claimed_joints import Claims
from manipcli.plan.clearance import StatedClearance, least_clearance, stated_clearances
from manipcli.plan.grasp_margin import GraspMargin, grasp_margin
from manipcli.plan.hand import SPEED, closing_speed
from manipcli.plan.motion import Motion, PlanningState
from manipcli.plan.motion_margins import MotionMargins, motion_margins
from manipcli.plan.outline import BlockOutline, PlanOutline, StepOutline
from manipcli.plan.part_pairs import expanded_pairs
from manipcli.plan.path_kind import path_kind
from manipcli.plan.planner import Planner
from manipcli.plan.search_budget import SearchBudget
from manipcli.plan.trajectory import JointTrajectory
from manipcli.record.start_state import StartState
from manipcli.simulate.engines import ENGINES
from manipcli.spec.planner import PlannerSpec
from manipcli.task.camera_sights import camera_sights
from manipcli.task.part import WHOLE
from manipcli.task.plan_steps import PlannedStep, plan_units
from manipcli.task.restored import restored_start
from manipcli.task.task import Task


@dataclass(frozen=True, slots=True)
class PlannedMotion:
    """One motion of one step, for tables and files; `branch`: the outcomes before it, `if_1: else`; `beside`: its step
    is done at the same time as the one before."""

    step_id: str
    verb: str
    label: str
    trajectory: JointTrajectory | None
    duration: float
    branch: str = ""
    beside: bool = False


@dataclass(frozen=True, slots=True)
class Plan:
    """The plan of a task, or of the part of it that is run.

    Attributes:
        steps: in order, with `then` at every choice, up to the first that is planned during the run.
        start: the state before them.
        planner: re-plans steps from measured states.
        judged: places of expectations and watches, for the log.
        branches: the steps of every stretch that is planned before the run, by the outcomes of the choices before it.
        items: the steps and blocks that are run.
        branch: the outcomes that lead to `steps`, in words; "" for the path with `then` at every choice.
        listed: every step of the task for the log, in the order of the file.
        blocks: the same for blocks.
        effort: the least `plan: {effort: ...}` with which it is found.
    """

    steps: tuple[PlannedStep, ...]
    start: PlanningState
    planner: Planner
    judged: tuple[str, ...] = ()
    branches: Mapping[Outcomes, tuple[PlannedStep, ...]] = field(default_factory=dict)
    items: tuple[Item, ...] = ()
    branch: str = ""
    listed: tuple[StepOutline, ...] = ()
    blocks: tuple[BlockOutline, ...] = ()
    effort: float = 0.0

    @property
    def every(self) -> tuple[PlannedStep, ...]:
        """Every planned step once, in the order of the file: on the first path on which it is done."""
        found: dict[int, PlannedStep] = {}
        for steps in (self.steps, *(self.branches[key] for key in sorted(self.branches, reverse=True))):
            found = {step.index: step for step in steps} | found
        return tuple(found[k] for k in sorted(found))

    @property
    def duration(self) -> float:
        """Planned duration [s] of `steps`."""
        total = last = 0.0
        for step in self.steps:
            total += max(0.0, step.plan.duration - last) if step.beside else step.plan.duration
            last = step.plan.duration
        return total

    def along(self, outcomes: Outcomes) -> Plan:
        """The same plan with the path of these outcomes as its `steps`, as far as it is planned."""
        keys = [outcomes[:k] for k in range(len(outcomes) + 1)]
        return replace(self, steps=tuple(step for key in keys for step in self.branches.get(key, ())))

    @property
    def motions(self) -> tuple[PlannedMotion, ...]:
        """All motions of `steps` in order."""
        return tuple(
            PlannedMotion(
                step.id, step.verb, motion.label, motion.trajectory, motion.duration, self.branch, step.beside
            )
            for step in self.steps
            for motion in step.plan.motions
        )

    @property
    def stretches(self) -> tuple[Plan, ...]:
        """A plan for the steps of each stretch, in the order of their outcomes, `then` first; one without choices."""
        keys = sorted(self.branches, key=lambda key: [not outcome for outcome in key])
        return tuple(replace(self, steps=self.branches[key], branch=named(self.items, key)) for key in keys)

    @property
    def combinations(self) -> tuple[Plan, ...]:
        """A plan with the steps of each combination of outcomes, as far as it is planned."""
        inner = {key[:-1] for key in self.branches if key}
        keys = sorted((key for key in self.branches if key not in inner), key=lambda key: [not one for one in key])
        return tuple(replace(self.along(key), branch=named(self.items, key)) for key in keys)

    @property
    def merged(self) -> Plan:
        """The same plan with steps at the same time as one step, whose first motion also moves the hand."""
        found: list[PlannedStep] = []
        for step in self.steps:
            if not step.beside:
                found.append(step)
                continue
            arm, hand = sorted((found.pop(), step), key=lambda one: all(m.trajectory is None for m in one.plan.motions))
            (grip, *_), (first, *rest) = hand.plan.motions, arm.plan.motions
            both = replace(
                first,
                grip=grip.grip,
                duration=max(first.duration, grip.duration),
                lets_go=grip.lets_go,
                label=f"{first.label}, {grip.label}",
            )
            plan = replace(arm.plan, motions=(both, *rest))
            found.append(replace(arm, id=f"{arm.id}+{hand.id}", plan=plan, beside=False))
        return replace(self, steps=tuple(found))

    def spans(self) -> tuple[tuple[Motion, PlanningState, PlanningState], ...]:
        """Each motion with the states before and after it."""
        found: list[tuple[Motion, PlanningState, PlanningState]] = []
        for step in self.steps:
            found += spans(step.plan.motions, step.start, step.plan.end)
        return tuple(found)

    def clearances(self) -> tuple[CollisionHit | None, ...]:
        """The least clearance of each of `motions`: parts, distance and time; None where nothing moves."""
        return tuple(least_clearance(self.planner, motion, end) for motion, _, end in self.spans())

    def stated_clearances(self) -> tuple[StatedClearance, ...]:
        """What the motions keep of each clearance that the task states for a pair."""
        return stated_clearances(self.planner, self.spans())

    def grasps(self) -> tuple[tuple[str, GraspMargin], ...]:
        """Id of each step that ends with an object in the closed hand, and the margin of its grasp."""
        found = ((step.id, grasp_margin(self.planner, step.plan)) for step in self.every)
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
        return PlanOutline(self.listed, self.judged, self.blocks)


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
    spec = task.spec
    budget = _budget(task, planner, deeper=deeper)
    items = block_tree(len(spec.steps), spec.blocks)
    if task.part != WHOLE:
        items = clipped(items, range(len(spec.steps))[task.part.first : task.part.last])
    branches = _branches(task, planner, items, start, on_progress, budget)
    judged = tuple(task.log_place(*key) for key in spec.judged_at)
    plan = Plan((), start, planner, judged, branches, items, effort=spec.plan.effort * budget.used)
    plan = plan.along(max(branches, key=lambda outcomes: (all(outcomes), len(outcomes))))
    return replace(plan, listed=_listed(task, plan), blocks=_blocks(task))


def _branches(
    task: Task,
    planner: Planner,
    items: Sequence[Item],
    start: PlanningState,
    on_progress: Callable[[str], None],
    budget: SearchBudget,
) -> Mapping[Outcomes, tuple[PlannedStep, ...]]:
    """The plans of all branches; see `plan_branches`."""

    def solve(units: Sequence[Unit], before: PlanningState, outcomes: Outcomes) -> Solved[PlannedStep]:
        own = planner
        if not all(outcomes):  # other branches draw for themselves, so that they change nothing on the first path
            own = planner.keeping(())
            own.rng = np.random.default_rng(task.spec.simulation.seed)
        leads = [outcomes[:n] for n in range(len(outcomes) + 1)]
        where = {k: named(items, lead) for lead in leads for unit in stretch(items, lead).units for k in unit}
        return plan_units(task, own, units, before, on_progress=on_progress, branch=where.__getitem__, budget=budget)

    return plan_branches(items, start, solve)


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
    items = clipped(block_tree(len(task.spec.steps), task.spec.blocks), range(task.part.first))
    before = _branches(task, planner, items, start, on_progress, _budget(task, planner))
    done = Plan((), start, planner, branches=before).along(max(before, key=lambda key: (all(key), len(key)))).steps
    return replace(done[-1].plan.end if done else start, position=state.position, at_start=False)


def _listed(task: Task, plan: Plan) -> tuple[StepOutline, ...]:
    planned = {step.index: step for step in plan.every}
    return tuple(
        StepOutline(one.id, one.verb, one.place, one.plan.duration, one.plan.motions)
        if (one := planned.get(k)) is not None
        else StepOutline(str(step.id), step.verb, task.log_place("steps", k), None)
        for k, step in enumerate(task.spec.steps)
    )


def _blocks(task: Task) -> tuple[BlockOutline, ...]:
    return tuple(
        BlockOutline(
            block.id, block.kind, block.word, block.first, block.last, block.split, block.parent,
            task.log_place("blocks", k),
        )
        for k, block in enumerate(task.spec.blocks)
    )  # fmt: skip


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


def start_position(task: Task) -> Array:
    """Start configuration (n,) [rad or m]: the task's `start` pose, else `home`, else zero clamped to the limits."""
    return configuration(task.robot, task.spec.start)


def _start(task: Task) -> PlanningState:
    return PlanningState(position=start_position(task), bodies=tuple(body.X_WO for body in task.scene.movable))


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
        sights=camera_sights(task.sensors, task.robot, task.scene),
    )
