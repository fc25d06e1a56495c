"""What a step must have done besides its motions: whether objects are held, placed or poured in the measured world."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import radians
from typing import Final

import numpy as np

from manipcli.core.units import readable
from manipcli.model.grasp import GRIP_FORCE, pressing
from manipcli.model.state import Contact
from manipcli.plan.jointed import position_of
from manipcli.plan.motion import JointGoal, PlanningState, StepPlan
from manipcli.plan.planner import Planner
from manipcli.run.inserted import insertion_text, not_inserted
from manipcli.run.replan import between, deg, mm
from manipcli.scene.joints import SceneJoint
from manipcli.spec.counted import selections

PLACED: Final = 0.01
"""[m] A placed object further than this from its planned pose is not placed."""
RIGHTED: Final = radians(10.0)
"""[rad] The same for its rotation, without rotations about the axes of a round object."""


def not_placed(planner: Planner, plan: StepPlan, now: PlanningState) -> str:
    """Why the object that a step sets down is not at its place; "" where it is, or where the step places nothing.

    Args:
        planner: of the task.
        plan: of the step; its `end` has the planned pose.
        now: the measured poses of all bodies.
    """
    if not plan.placed:
        return ""
    name = plan.placed
    X_WG, X_WO = planner.body_pose(plan.end, name), planner.body_pose(now, name)
    away, rotation = from_place(planner, plan, now)
    if away <= PLACED and rotation <= RIGHTED:
        return ""
    drop = float(X_WG.p[2] - X_WO.p[2])
    lower = f", {mm(drop)} lower" if drop > PLACED else f", {mm(-drop)} higher" if drop < -PLACED else ""
    limits = f"limits {mm(PLACED)} and {deg(RIGHTED)}"
    return f"'{name}' is {mm(away)} and {deg(rotation)} from its place{lower}; {limits}"


def from_place(planner: Planner, plan: StepPlan, now: PlanningState) -> tuple[float, float]:
    """Distance [m] and angle [rad] of the object that a step sets down from its planned pose; see `not_placed`."""
    name = plan.placed
    return between(
        planner.body_pose(plan.end, name), planner.body_pose(now, name), round_as=planner.scene.body(name).kind
    )


def not_poured(planner: Planner, plan: StepPlan, now: PlanningState) -> str:
    """Which bodies that a step pours are not in the receiving container; "" where all are.

    Args:
        planner: of the task.
        plan: of the step.
        now: the measured poses of all bodies, and what the hand carries.
    """
    if not plan.poured:
        return ""
    inside = planner.contents(replace(now, carried=None), plan.into)
    missing = [name for name in plan.poured if name not in inside]
    if not missing or (plan.portion is not None and _reached(planner, plan, inside)):
        return ""
    if plan.portion is not None:
        return f"less than {plan.portion.text} was poured into '{plan.into}': {counted(planner, plan, now)}"
    first = missing[0]
    where = f"still in '{_held(plan)}'" if first in _kept(planner, plan, now) else f"at {_at(planner, now, first)}"
    counts = f"; {counted(planner, plan, now)}" if len(plan.poured) > 1 else ""
    return f"'{first}' is not in '{plan.into}', it is {where}{counts}"


def not_moved(planner: Planner, plan: StepPlan, now: PlanningState) -> str:
    """Why the joint that a step moves is not where it should be; "" where it is, or where the step moves none.

    Args:
        planner: of the task.
        plan: of the step.
        now: the measured poses of all bodies.
    """
    goal = plan.joint
    if goal is None:
        return ""
    joint, position = _joint(planner, goal, now)
    if goal.short(position) <= goal.within:
        return ""
    bound = "at least " if goal.side > 0.0 else "at most " if goal.side < 0.0 else ""
    expected = f"expected {bound}{_travel(goal.position, joint)} within {_travel(goal.within, joint)}"
    return f"joint '{joint.name}' is at {_travel(position, joint)}, {expected}"


def _joint(planner: Planner, goal: JointGoal, now: PlanningState) -> tuple[SceneJoint, float]:
    """The joint that a step moves, and its position; of one without limits, on the revolution nearest to the goal."""
    joint = next(joint for joint in planner.scene.joints if joint.name == goal.name)
    return joint, goal.position + float(joint.apart(position_of(planner, now, joint), goal.position))


def _travel(value: float, joint: SceneJoint) -> str:
    return mm(value) if joint.slides else deg(value)


def missed(planner: Planner, plan: StepPlan, now: PlanningState, *, poured: bool) -> str:
    """Why a step does not have its result in the state `now`; "" where it has. `poured`: what it pours counts."""
    why = not_placed(planner, plan, now) or not_moved(planner, plan, now) or not_inserted(planner, plan.inserted, now)
    return why or (not_poured(planner, plan, now) if poured else "")


def margin(planner: Planner, plan: StepPlan, now: PlanningState) -> tuple[float, str]:
    """By how much a step has its result: to the limit of its place [m], or of its joint [m or rad], and the unit."""
    if plan.joint is None:
        return PLACED - from_place(planner, plan, now)[0], "m"
    joint, position = _joint(planner, plan.joint, now)
    return plan.joint.within - plan.joint.short(position), joint.unit


def result_texts(
    planner: Planner, plan: StepPlan, situation: Callable[[PlanningState], PlanningState] | None
) -> list[str]:
    """What a step that is done reports of its result. `situation`: measures the state; None without physics."""
    if plan.inserted is not None and situation is not None:
        return [insertion_text(planner, plan.inserted, situation(plan.end))]
    if plan.joint is None or situation is None:
        return poured_texts(planner, plan, situation)
    joint, position = _joint(planner, plan.joint, situation(plan.end))
    return [f"joint '{joint.name}' is at {_travel(position, joint)}"]


def _reached(planner: Planner, plan: StepPlan, names: Sequence[str]) -> bool:
    """Whether the bodies of these names that a step pours are its portion."""
    contents = [planner.scene.body(name) for name in plan.poured]
    return plan.portion is None or plan.portion.reached(contents, [body for body in contents if body.name in names])


def poured_texts(
    planner: Planner, plan: StepPlan, situation: Callable[[PlanningState], PlanningState] | None
) -> list[str]:
    """What a pour that is done reports: how many bodies are where, and a stream that was moved.

    `situation`: measures the state; None without physics.
    """
    counts = [counted(planner, plan, situation(plan.end))] if situation is not None and selections(plan.poured) else []
    moved = plan.stream is not None and plan.stream.moved
    return [*counts, *([f"what is poured {plan.stream.text}"] if plan.stream is not None and moved else [])]


def counted(planner: Planner, plan: StepPlan, now: PlanningState) -> str:
    """Where the bodies are that a step pours: `18 of 20 in 'tray', 1 still in 'cup', 1 on 'desk'`."""
    inside = set(planner.contents(replace(now, carried=None), plan.into))
    kept = _kept(planner, plan, now)
    others = Counter(
        f"still in '{_held(plan)}'" if name in kept else _below(planner, now, name)
        for name in plan.poured
        if name not in inside
    )
    arrived = sum(name in inside for name in plan.poured)
    rest = (f"{number} {where}" for where, number in sorted(others.items()))
    return ", ".join((f"{arrived} of {len(plan.poured)} in '{plan.into}'", *rest))


def _held(plan: StepPlan) -> str:
    return plan.end.carried.body if plan.end.carried is not None else ""


def _kept(planner: Planner, plan: StepPlan, now: PlanningState) -> set[str]:
    """What is still in the body that a step pours from."""
    return set(planner.contents(now, _held(plan))) if _held(plan) else set()


def _below(planner: Planner, now: PlanningState, name: str) -> str:
    """`on 'desk'`: the highest fixed body whose bounding box is below the centre of a body; else `elsewhere`."""
    body = planner.scene.body(name)
    p = planner.body_pose(now, name).apply(body.centre)
    found: list[tuple[float, str]] = []
    for other in planner.scene.bodies:
        half = np.abs(other.X_WO.R) @ other.size / 2.0
        away = p - other.X_WO.apply(other.centre)
        if other.fixed and bool(np.all(np.abs(away[:2]) <= half[:2])) and away[2] >= half[2]:
            found.append((float(half[2] - away[2]), other.name))
    return f"on '{max(found)[1]}'" if found else "elsewhere"


def not_squeezed(contacts: Sequence[Contact], body: str) -> str:
    """Why a closed hand does not hold a body that it does not squeeze."""
    links = ", ".join(f"'{link}' ({readable(force, 'N')})" for force, link in pressing(contacts, body))
    if not links:
        return f"the hand does not hold '{body}': no robot link presses on it"
    least = f"expected at least {readable(GRIP_FORCE, 'N')} from opposite sides"
    return f"the hand does not hold '{body}': pressed by {links}, {least}"


def _at(planner: Planner, now: PlanningState, name: str) -> str:
    x, y, z = planner.body_pose(now, name).p
    return f"[{x:.3f}, {y:.3f}, {z:.3f}] m"
