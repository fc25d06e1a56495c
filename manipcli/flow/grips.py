"""Can the hands of a task close as fast, and press as hard, as they are asked to?"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.errors import Finding
from manipcli.core.geometry import Array
from manipcli.core.text import digits, told_apart
from manipcli.core.units import readable
from manipcli.flow.load import Task
from manipcli.flow.plan import Plan
from manipcli.model.posture import with_mimics
from manipcli.plan.hand import fingers, moved_links
from manipcli.plan.planner import Planner
from manipcli.plan.step import PlanningState
from manipcli.spec.controllers import GainsSpec, GripperSpec, Interface

ENOUGH: Final = 1.01
"""A force that is asked beyond this share of what there is is not met."""
LIGHT: Final = 740.0
"""[N/kg] A force so large for the mass may let an object creep. Measured in carries of 2 to 5 s: two fingers by 0.2 to
0.4 mm up to 3500 N/kg, and by 1.5 mm at 7000; three by 0.4 mm at 400 N/kg, by 2 to 3 mm from 800 on."""
MUCH: Final = 1.1
"""So many times the force that is asked, and a hand that cannot be told it is told of."""
RESERVE: Final = 2.0
"""So many times its weight friction is to carry: it also accelerates what is carried, and keeps it from turning.
Measured with blocks between two fingers, lifted 10 cm: up to 1.6 none stays in the hand, at 2 few do, at 2.5 most."""
LEVEL: Final = 0.1
"""A finger whose way climbs less than this carries by friction alone."""
LIFTED: Final = 5e-3
"""[m] from which on what is held no longer rests."""
NUDGE: Final = 1e-4
"""[rad or m] by which a finger is moved to see how its parts move."""


@dataclass(frozen=True, slots=True)
class _Grasp:
    """The hand is to close with `force` [N] in a step, number `index`, which ends in `end`; `target`: of its joints."""

    index: int
    step: str
    end: PlanningState
    force: float
    joints: tuple[str, ...]
    target: Array


def _grasps(plan: Plan) -> Iterator[_Grasp]:
    """Every one for which a force is known."""
    for k, step in enumerate(plan.steps):
        for grip in (motion.grip for motion in step.plan.motions):
            if grip is not None and grip.force is not None:
                yield _Grasp(k, step.id, step.plan.end, grip.force, grip.joints, grip.target)


def too_swift(task: Task) -> Iterator[Finding]:
    """Hands whose references are to move faster than a joint may; the default never is."""
    for name, spec in task.controllers.controllers.items():
        if not isinstance(spec, GripperSpec) or spec.speed is None:
            continue
        limits = {joint: task.robot.joint(joint).limits.velocity for joint in spec.joints}
        limit, joint = min((limit or math.inf, joint) for joint, limit in limits.items())
        if spec.speed > limit:
            unit = f"{task.robot.joint(joint).unit}/s"
            swift, most = told_apart(spec.speed, limit, form=".3g")
            message = f"{joint}: its references move at {swift} {unit}, its velocity limit is {most} {unit}"
            place = task.controllers_file.place("controllers", name, "speed")
            yield Finding("CTRL167", message, place, "without `speed` they move as fast as all joints may", "warning")


def strained(task: Task, plan: Plan) -> Iterator[Finding]:
    """Grasps with more force than a finger that slides can press with, also once it is as weak as `too_light` asks."""
    for one in _grasps(plan):
        for name in one.joints:
            most = _most(task, name)
            if _sensible(task, one.end, one.force) > most:
                message = f"step '{one.step}': a grasp with {one.force:.3g} N; {name} presses with {most:.3g} N at most"
                hint = "lower `force`, or raise what limits it: the joint's effort, or `max_effort`"
                yield Finding("TASK238", message, task.file.place("steps", one.index), hint, "warning")


def _most(task: Task, name: str) -> float:
    """[N] with which a finger can press whose joint slides; infinite of one that turns.

    Fingers that mimic it take their part: the effort is that of all of them, f (1 + sum |multiplier|).
    """
    joint = task.robot.joint(name)
    if joint.type != "prismatic":
        return math.inf
    owners = [one for one in task.controllers.controllers.values() if isinstance(one, GripperSpec)]
    limits = [joint.limits.effort, *(one.max_effort for one in owners if name in one.joints)]
    return min((limit for limit in limits if limit), default=math.inf) / _shared(task, name)


def _shared(task: Task, name: str) -> float:
    """The effort of a joint that slides for each newton with which its finger, and those that mimic it, press."""
    mimics = [one.mimic for one in task.robot.joints if one.mimic is not None and one.mimic.joint == name]
    return 1.0 + sum(abs(mimic.multiplier) for mimic in mimics)


def _sensible(task: Task, end: PlanningState, force: float) -> float:
    """[N] of a grasp, once it is as weak as `too_light` asks: what is told of one grasp points one way."""
    return force if end.carried is None else min(force, LIGHT * task.scene.body(end.carried.body).mass)


def too_light(task: Task, plan: Plan) -> Iterator[Finding]:
    """Grasps of objects of next to no mass beside the force, by which the engine lets them creep, whatever gravity is.

    Its solver stops after a number of iterations, each of which carries an impulse from one finger through the object
    to the other: of two that are heavy beside what is between them, an error of their forces is left, and moves it.
    """
    for one in _grasps(plan):
        if one.end.carried is None:
            continue
        body = task.scene.body(one.end.carried.body)
        if one.force > LIGHT * body.mass:
            message = f"step '{one.step}': {one.force:.3g} N are much for '{body.name}' of "
            message += f"{readable(body.mass, 'kg')}: it may creep in the hand by millimetres"
            hint = f"a force below {digits(LIGHT * body.mass)} N, or more mass: the contact solver of the engine "
            hint += "leaves errors that move light things between heavy ones"
            yield Finding("TASK239", message, task.file.place("steps", one.index), hint, "warning")


def too_heavy(task: Task, plan: Plan) -> Iterator[Finding]:
    """What is lifted between two level fingers that slide, where their friction, 2 mu F, is not clearly more than its
    weight.

    Of hands of more fingers, and of fingers that close from below, nothing is said: those also hold by their form.
    """
    gravity = task.scene.gravity
    g = float(np.linalg.norm(gravity))
    if not g:
        return
    for one in _grasps(plan):
        if one.end.carried is None:
            continue
        body = task.scene.body(one.end.carried.body)
        ends = [step.plan.end for step in plan.steps[one.index :]]
        carrying = itertools.takewhile(lambda end: end.carried is not None, ends)
        heights = [-float(plan.planner.body_pose(end, body.name).p @ gravity) / g for end in carrying]
        if max(heights) < heights[0] + LIFTED or not _between_two(plan.planner, one.end, one.joints, gravity / g):
            continue
        force = min(_holds(task, name, one.force) for name in one.joints)
        friction = body.friction * task.robot.friction
        carried, weight = 2.0 * friction * force, body.mass * g
        if carried < RESERVE * weight:
            message = f"step '{one.step}': two fingers with {force:.3g} N each and a friction of {friction:.3g} carry "
            message += f"{carried:.3g} N; '{body.name}' of {readable(body.mass, 'kg')} weighs {weight:.3g} N"
            hint = "it will slip"
            if carried >= weight:
                twice = f"{weight / friction:.3g} N a finger carry it twice"
                hint = f"it may slip while it is accelerated, or turn: {twice}"
            elif friction:
                hint += f", it takes more than {0.5 * weight / friction:.3g} N a finger or more friction"
            yield Finding("TASK241", message, task.file.place("steps", one.index), hint, "warning")


def _holds(task: Task, name: str, force: float) -> float:
    """[N] of a finger that slides: commanded by position it is all that it has, else no more than is asked."""
    most = _most(task, name)
    return most if name in _owners(task, "position") else min(force, most)


def _between_two(planner: Planner, end: PlanningState, joints: tuple[str, ...], down: Array) -> bool:
    """Whether two links that slide, level and against each other, touch what is carried, and nothing else does."""
    robot, kinematics = planner.robot, planner.kinematics
    if any(robot.joint(name).type != "prismatic" for name in joints):
        return False
    links = sorted(part.removeprefix("robot/") for part in _touched(planner, end) if part.startswith("robot/"))
    if len(links) != 2 or not set(links) <= moved_links(robot, joints):
        return False
    q = np.array(end.position)
    q[list(robot.indices(joints))] += NUDGE
    nudged = with_mimics(robot, q)
    ways = [kinematics.forward(nudged, link).p - kinematics.forward(end.position, link).p for link in links]
    one, other = (way / np.linalg.norm(way) for way in ways)
    return abs(float(one @ down)) < LEVEL and float(one @ other) < LEVEL - 1.0


def too_soft(task: Task, plan: Plan) -> Iterator[Finding]:
    """Grasps with more force than the spring of a finger's gain gives, all the way from the object to the posture.

    A finger of one joint, alone or with others that mimic it, gives p |q_posture - q_object| of effort, and by virtual
    work that over `_closing` of force. It is asked for what `too_light` and `strained` leave of the force.
    """
    owners = _owners(task, "effort")
    for one in _grasps(plan):
        if one.end.carried is None:
            continue
        touched = _touched(plan.planner, one.end)
        for name, target in zip(one.joints, one.target, strict=True):
            if name not in owners or (one.joints.index(name),) not in fingers(task.robot, one.joints):
                continue
            controller, spec = owners[name]
            gains = spec.gains.get(name, GainsSpec())
            closing = _closing(plan.planner, one.end, name, touched)
            way = abs(float(target) - float(one.end.position[task.robot.joint_names.index(name)]))
            asked = min(_sensible(task, one.end, one.force), _most(task, name))
            if not closing or not way or gains.i or asked <= ENOUGH * gains.p * way / closing:
                continue
            given = f"p {digits(gains.p)} gives about {gains.p * way / closing:.2g} N"
            message = f"{name}: step '{one.step}' grasps with {one.force:.3g} N; {given}"
            than = "that" if asked == one.force else f"{asked:.3g} N"
            hint = f"p {digits(1.2 * asked * closing / way)} gives a fifth more than {than}"
            place = task.controllers_file.place("controllers", controller, "gains", name)
            yield Finding("CTRL168", message, place, hint, "warning")


def unheeded(task: Task, plan: Plan) -> Iterator[Finding]:
    """Hands that are commanded by position and asked for less force than their motors press with.

    Such a motor follows its reference with all the effort that it may have. The reference stops where a finger feels
    the force, and there it is within the object already: what the finger presses with is the limit of its effort.
    """
    owners = _owners(task, "position")
    told: set[str] = set()
    for one in _grasps(plan):
        for name in one.joints:
            if name not in owners or name in told:
                continue
            shared = _effort_each(task, plan, one, name)
            limit = task.robot.joint(name).limits.effort or math.inf
            if not shared or limit / shared <= MUCH * one.force:
                continue
            told.add(name)
            given = f"{limit / shared:.3g} N, its effort limit" if limit < math.inf else "no limit of its effort"
            message = f"{name}: step '{one.step}' grasps with {one.force:.3g} N; commanded by position it presses "
            message += f"with {given}: `force` only says at which contact force it stops"
            least = f"limits.{name}.effort: {digits(1.05 * shared * one.force)}"
            hint = f"command it by effort, or limit that (robot file, {least})"
            place = task.controllers_file.place("controllers", owners[name][0], "command_interface")
            yield Finding("CTRL171", message, place, hint, "warning")


def _effort_each(task: Task, plan: Plan, grasp: _Grasp, name: str) -> float:
    """The effort of a joint [N m or N] for each newton of its finger; 0 where that is not known."""
    if task.robot.joint(name).type == "prismatic":
        return _shared(task, name)
    if grasp.end.carried is None or (grasp.joints.index(name),) not in fingers(task.robot, grasp.joints):
        return 0.0
    return _closing(plan.planner, grasp.end, name, _touched(plan.planner, grasp.end))


def _owners(task: Task, interface: Interface) -> dict[str, tuple[str, GripperSpec]]:
    """By joint: the gripper controller that commands it so, and its name."""
    return {
        joint: (name, spec)
        for name, spec in task.controllers.controllers.items()
        if isinstance(spec, GripperSpec) and spec.command_interface == interface
        for joint in spec.joints
    }


def _touched(planner: Planner, end: PlanningState) -> set[str]:
    """The parts that touch what is carried, and itself; empty where nothing is."""
    if end.carried is None:
        return set()
    return {part for hit in planner.grasping(end, end.carried.body).every(end.position) for part in (hit.a, hit.b)}


def _closing(planner: Planner, situation: PlanningState, name: str, touched: Collection[str]) -> float:
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
