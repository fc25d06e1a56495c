"""Grasps of a plan, and the forces that fingers can press with: what several checks of grips ask."""

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
"""[N/kg] A force so large for the mass may let an object creep. Measured in carries of 2 to 5 s: two fingers by 0.2 to
0.4 mm up to 3500 N/kg, and by 1.5 mm at 7000; three by 0.4 mm at 400 N/kg, by 2 to 3 mm from 800 on."""
NUDGE: Final = 1e-4
"""[rad or m] by which a finger is moved to see how its parts move."""


@dataclass(frozen=True, slots=True)
class Grasp:
    """The hand is to close with `force` [N] in a step, number `index`, which ends in `end`; `target`: of its joints."""

    index: int
    step: str
    end: PlanningState
    force: float
    joints: tuple[str, ...]
    target: Array


def grasps(plan: Plan) -> Iterator[Grasp]:
    """Every one for which a force is known."""
    for k, step in enumerate(plan.steps):
        for grip in (motion.grip for motion in step.plan.motions):
            if grip is not None and grip.force is not None:
                yield Grasp(k, step.id, step.plan.end, grip.force, grip.joints, grip.target)


def largest_force(subject: Subject, name: str) -> float:
    """[N] with which a finger can press whose joint slides; infinite of one that turns.

    Fingers that mimic it take their part: the effort is that of all of them, f (1 + sum |multiplier|).
    """
    joint = subject.task.robot.joint(name)
    if joint.type != "prismatic":
        return math.inf
    hand = subject.hand_joints.get(name)
    limits = [joint.limits.effort, None if hand is None else hand.settings.max_effort]
    return min((limit for limit in limits if limit), default=math.inf) / effort_per_force(subject.task, name)


def effort_per_force(task: Task, name: str) -> float:
    """The effort of a joint that slides for each newton with which its finger, and those that mimic it, press."""
    mimics = [one.mimic for one in task.robot.joints if one.mimic is not None and one.mimic.joint == name]
    return 1.0 + sum(abs(mimic.multiplier) for mimic in mimics)


def sensible_force(task: Task, end: PlanningState, force: float) -> float:
    """[N] of a grasp, reduced to what a light object takes, so that all findings on a grasp agree."""
    return force if end.carried is None else min(force, LIGHT * task.scene.body(end.carried.body).mass)


def touched_parts(planner: Planner, end: PlanningState) -> set[str]:
    """The parts that touch what is carried, and itself; empty where nothing is."""
    if end.carried is None:
        return set()
    return {part for hit in planner.grasping(end, end.carried.body).every(end.position) for part in (hit.a, hit.b)}


def closing_rate(planner: Planner, situation: PlanningState, name: str, touched: Collection[str]) -> float:
    """How fast a joint, with those that mimic it, closes the gap between the parts that touch, at the tool's point.

    |dp_1/dq - dp_2/dq| of two sides, |dp/dq| of one that slides [m/rad or 1]; 0 where it is neither.
    """
    robot, kinematics = planner.robot, planner.kinematics
    mover = {joint.child: joint for joint in robot.joints}
    p_WT = planner.tool_pose(situation).p
    q = np.array(situation.position)
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
        p_LT = kinematics.forward(situation.position, link).inverse().apply(p_WT)
        sides[side] = (kinematics.forward(nudged, link).apply(p_LT) - p_WT) / NUDGE
    rates = list(sides.values())
    if len(rates) == 1 and robot.joint(name).type == "prismatic":
        return float(np.linalg.norm(rates[0]))
    return float(np.linalg.norm(rates[0] - rates[1])) if len(rates) == 2 else 0.0
