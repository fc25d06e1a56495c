"""The grasps of a plan and the grip forces of fingers, for several preflight checks."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.configuration import with_mimics
from manipcli.plan.hand import moved_links
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.preflight.preflight import Subject
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task

LIGHT: Final = 740.0
"""[N/kg] Above this force per mass an object may creep in the hand. Measured over carries of 2 to 5 s: with two fingers
0.2 to 0.4 mm up to 3500 N/kg and 1.5 mm at 7000; with three 0.4 mm at 400 N/kg and 2 to 3 mm from 800 on."""
NUDGE: Final = 1e-4
"""[rad or m] Step of a finger joint for finite differences."""


@dataclass(frozen=True, slots=True)
class Grasp:
    """A grasp of a plan.

    Attributes:
        index, step: number and id of the step.
        end: planned state at the end of the step.
        force: [N] asked for.
        joints: of the hand.
        target: (n) [rad or m] where they are commanded to.
    """

    index: int
    step: str
    end: PlanningState
    force: float
    joints: tuple[str, ...]
    target: Array


def grasps(plan: Plan) -> Iterator[Grasp]:
    """All grasps of a plan that have a force; none where an attachment holds objects."""
    if plan.planner.robot.holding is not None:
        return
    for step in plan.every:
        for grip in (motion.grip for motion in step.plan.motions):
            if grip is not None and grip.force is not None:
                yield Grasp(step.index, step.id, step.plan.end, grip.force, grip.joints, grip.target)


def largest_force(subject: Subject, name: str) -> float:
    """[N] The largest force of a finger with a prismatic joint; infinite for a revolute joint.

    Fingers that mimic the joint share its effort: effort = f (1 + sum |multiplier|).
    """
    joint = subject.task.robot.joint(name)
    if joint.type != "prismatic":
        return math.inf
    hand = subject.hand_joints.get(name)
    limits = [joint.limits.effort, None if hand is None else hand.settings.max_effort]
    return min((limit for limit in limits if limit), default=math.inf) / effort_per_force(subject.task, name)


def effort_per_force(task: Task, name: str) -> float:
    """The effort of a prismatic joint per newton of its finger and of each finger that mimics it."""
    mimics = [joint.mimic for joint in task.robot.joints if joint.mimic is not None and joint.mimic.joint == name]
    return 1.0 + sum(abs(mimic.multiplier) for mimic in mimics)


def sensible_force(task: Task, end: PlanningState, force: float) -> float:
    """[N] The force of a grasp, at most `LIGHT` times the mass of the object, so that all findings agree."""
    return force if end.carried is None else min(force, LIGHT * task.scene.body(end.carried.body).mass)


def touched_parts(planner: Planner, end: PlanningState) -> set[str]:
    """The carried object and the parts in contact with it; empty if nothing is carried."""
    if end.carried is None:
        return set()
    return {part for hit in planner.grasping(end, end.carried.body).every(end.position) for part in (hit.a, hit.b)}


def closing_rate(planner: Planner, state: PlanningState, name: str, touched: Collection[str]) -> float:
    """Closing speed of the gap between the parts in contact per joint velocity, at the tool point [m/rad or 1].

    |dp_1/dq - dp_2/dq| for two moving sides, |dp/dq| for one prismatic side; 0 otherwise.
    """
    robot, kinematics = planner.robot, planner.kinematics
    mover = {joint.child: joint for joint in robot.joints}
    p_WT = planner.tool_pose(state).p
    q = np.array(state.position)
    q[robot.joint_names.index(name)] += NUDGE
    nudged = with_mimics(robot, q)
    sides: dict[str, Array] = {}
    for link in sorted(moved_links(robot, [name])):
        if f"robot/{link}" not in touched:
            continue
        side = above = link
        while above in mover:
            joint = mover[above]
            if joint.name == name or (joint.mimic is not None and joint.mimic.joint == name):
                side = above
            above = joint.parent
        p_LT = kinematics.forward(state.position, link).inverse().apply(p_WT)
        sides[side] = (kinematics.forward(nudged, link).apply(p_LT) - p_WT) / NUDGE
    rates = list(sides.values())
    if len(rates) == 1 and robot.joint(name).type == "prismatic":
        return float(np.linalg.norm(rates[0]))
    return float(np.linalg.norm(rates[0] - rates[1])) if len(rates) == 2 else 0.0
