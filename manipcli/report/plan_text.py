"""A plan as text: tables of motions, margins and candidates; and why a task has no plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from manipcli.core.refused_candidates import RefusedCandidates
from manipcli.core.text import number_of
from manipcli.plan.block_tree import choices
from manipcli.plan.clearance import StatedClearance
from manipcli.plan.grasp_margin import weakest_first
from manipcli.plan.motion_margins import Binding, MotionMargins
from manipcli.plan.why_not import by_stage
from manipcli.report.rounds import first_of_rounds, round_of
from manipcli.report.table import table
from manipcli.task.plan_task import Plan

MOST: Final = 8
"""Most rows of refused candidates, unless all are asked for."""


def render_text(task: str, plan: Plan, *, every: bool = False) -> str:
    """Tables with one row per motion (the step's name only at its first), per margin, and per stage of candidates.

    `every`: show all rows of refused candidates.
    """
    parts = []
    for part in plan.stretches if len(plan.branches) > 1 else (plan,):
        if part.branch:
            parts.append(f"branch {part.branch}:")
        if part.steps:
            margins = part.margins()
            parts += [_motions(part, margins), _margins(part, margins)]
    parts.append("\n".join(_stated(plan, each) for each in plan.stated_clearances()))
    parts.append(_grasps(plan))
    poured = [(step, step.plan.stream) for step in plan.every if step.plan.stream is not None]
    parts.append("\n".join(f"{step.id}: what is poured {stream.text}" for step, stream in poured))
    chosen = [step for step in plan.every if step.dropped and step.candidate]
    parts.append("\n".join(f"{step.id} takes candidate {len(step.dropped) + 1}: {step.candidate}" for step in chosen))
    parts.append(render_refused(by_stage([(step.id, one) for step in plan.every for one in step.dropped]), every=every))
    beyond = choices(plan.items).beyond
    if beyond is not None:
        parts.append(f"the steps after '{beyond.spec.id}' are planned during the run")
    ways = plan.combinations
    if len(ways) > 1:
        rows = [(way.branch, str(len(way.steps)), f"{way.duration:.2f} s") for way in ways]
        parts.append(table(("branch", "steps", "duration"), rows, right=("steps", "duration")))
        shortest, longest = (of(way.duration for way in ways) for of in (min, max))
        parts.append(f"✓ {task} planned: {len(ways)} branches, {shortest:.2f} to {longest:.2f} s")
    else:
        parts.append(f"✓ {task} planned: {number_of(len(plan.motions), 'motion')}, {plan.duration:.2f} s")
    return "\n\n".join(part for part in parts if part)


def _grasps(plan: Plan) -> str:
    """The margin of each grasp; of the rounds of a loop, the smallest."""
    grasps = weakest_first(plan.grasps(), lambda step: round_of(step, "") or step)
    told = first_of_rounds(grasps, lambda grasp: round_of(grasp[0], grasp[1].text))
    return "\n".join(f"{step} {margin.text}{more}" for (step, margin), more in told)


def render_durations(plan: Plan) -> str:
    """The planned duration of each step, and of the whole plan."""
    times = [sum(motion.duration for motion in step.plan.motions) for step in plan.steps]
    rows = [(step.id, step.verb, f"{time:.2f} s") for step, time in zip(plan.steps, times, strict=True)]
    return table(("step", "verb", "planned"), [*rows, ("", "", f"{sum(times):.2f} s")], right=("planned",))


def render_refused(candidates: Sequence[RefusedCandidates], *, every: bool = False) -> str:
    """The refused candidates by stage, the commonest first; "" if there are none.

    `every`: show all rows, not the first only.
    """
    shown = candidates if every or len(candidates) <= MOST else candidates[: MOST - 1]
    rows = [(str(group.count), group.step, group.stage, group.cause) for group in shown]
    text = table(("refused", "step", "at", "because"), rows, right=("refused",)) if rows else ""
    left = candidates[len(shown) :]
    if left:
        text += f"\nand {sum(group.count for group in left)} more in {len(left)} rows; `--why` shows all"
    return text


def _stated(plan: Plan, clearance: StatedClearance) -> str:
    """`robot and shelf: stated clearance 20 mm, least 31.0 mm (robot/hand and shelf in pick_1 reach at 0.52 s)`."""
    a, b = clearance.between
    stated = f"stated clearance {1000.0 * clearance.stated:.3g} mm"
    near = clearance.nearest
    if near is None:
        return f"{a} and {b}: {stated}; no motion is checked for it"
    motion = plan.motions[clearance.motion]
    where = f"{near.a} and {near.b} in {motion.step_id} {motion.label} at {near.time:.2f} s"
    return f"{a} and {b}: {stated}, least {1000.0 * near.distance:.1f} mm ({where})"


def _motions(plan: Plan, found: Sequence[MotionMargins]) -> str:
    rows = []
    previous = None
    for motion, kind, near, margins in zip(plan.motions, plan.path_kinds(), plan.clearances(), found, strict=True):
        bound, dexterity = margins.binding, margins.manipulability
        rows.append(
            (
                f"{'+ ' * motion.beside}{motion.step_id}" if motion.step_id != previous else "",
                motion.verb if motion.step_id != previous else "",
                motion.label,
                kind or "-",
                f"{motion.duration:.3f} s",
                f"{_bound(bound)}, {100.0 * bound.share:.0f} % of the time" if bound else "-",
                f"{1000.0 * near.distance:.1f} mm" if near is not None else "-",
                f"{near.a} and {near.b} at {near.time:.2f} s" if near is not None else "-",
                f"{dexterity.least:.3f} at {dexterity.time:.2f} s" if dexterity else "-",
            )
        )
        previous = motion.step_id
    headers = ("step", "verb", "motion", "path", "duration", "bound by", "clearance", "between", "manipulability")
    return table(headers, rows, right=("duration", "clearance"))


def _bound(bound: Binding) -> str:
    """`joint_4 acceleration`, or `tool_speed`."""
    return bound.quantity if bound.quantity.startswith(bound.joint) else f"{bound.joint} {bound.quantity}"


def _margins(plan: Plan, found: Sequence[MotionMargins]) -> str:
    """The nearest joint of each kind of limit in each motion."""
    rows = [
        (
            f"{motion.step_id} {motion.label}" if first else "",
            margin.quantity,
            margin.joint,
            f"{100.0 * margin.used:.1f} %",
            f"{margin.time:.2f} s",
        )
        for motion, margins in zip(plan.motions, found, strict=True)
        for first, margin in ((k == 0, one) for k, one in enumerate(margins.margins))
    ]
    return table(("motion", "limit", "nearest joint", "used", "at"), rows, right=("used", "at")) if rows else ""
