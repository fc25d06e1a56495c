"""Objects lifted by friction alone that are too heavy for the grip force."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.core.geometry import Array
from manipcli.core.units import readable
from manipcli.model.configuration import with_mimics
from manipcli.model.grasp import friction_coefficient, friction_load
from manipcli.plan.hand import moved_links
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.preflight.grips import (
    NUDGE,
    grasps,
    largest_force,
    touched_parts,
)
from manipcli.preflight.preflight import Check, Subject

RESERVE: Final = 2.0
"""Least ratio of friction to weight: friction also accelerates the object and keeps it from rotating. Measured with
blocks between two fingers, lifted 10 cm: up to 1.6 none stays in the hand, at 2 few do, at 2.5 most."""
LEVEL: Final = 0.1
"""Largest slope of the motion of a finger that carries by friction alone."""
LIFTED: Final = 5e-3
"""[m] Least rise of a lifted object."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Objects lifted between two level prismatic fingers whose friction 2 mu F is less than `RESERVE` times the weight.

    Hands with more fingers, and fingers that close from below, also hold by form closure and are not checked.
    """
    task, plan = subject.task, subject.plan
    gravity = task.scene.gravity
    g = float(np.linalg.norm(gravity))
    if not g:
        return
    for grasp in grasps(plan):
        if grasp.end.carried is None:
            continue
        body = task.scene.body(grasp.end.carried.body)
        ends = [step.plan.end for step in plan.every if step.index >= grasp.index]
        carrying = itertools.takewhile(lambda end: end.carried is not None, ends)
        heights = [-float(plan.planner.body_pose(end, body.name).p @ gravity) / g for end in carrying]
        if max(heights) < heights[0] + LIFTED or not _between_two(plan.planner, grasp.end, grasp.joints, gravity / g):
            continue
        force = min(_held_force(subject, name, grasp.force) for name in grasp.joints)
        friction = friction_coefficient(task.robot, body)
        inside = plan.planner.contents(grasp.end, body.name)
        mass = body.mass + sum(task.scene.body(name).mass for name in inside)
        carried, weight = friction_load(friction, (force, force)), mass * g
        if carried < RESERVE * weight:
            heavy = f"{readable(mass, 'kg')}{' with its contents' if inside else ''}"
            message = (
                f"step '{grasp.step}': friction carries {carried:.3g} N, '{body.name}' ({heavy}) weighs {weight:.3g} "
                f"N: two fingers press with {force:.3g} N each, coefficient of friction {friction:.3g}"
            )
            hint = "it will slip: raise the friction"
            if carried >= weight:
                enough = f"{weight / friction:.3g} N per finger carries twice its weight"
                hint = f"it may slip or rotate while accelerated: {enough}"
            elif friction:
                hint = f"it will slip: use more than {0.5 * weight / friction:.3g} N per finger, or raise the friction"
            yield Diagnostic("TASK241", message, task.file.place("steps", grasp.index), hint, "warning")


def _held_force(subject: Subject, name: str, force: float) -> float:
    """[N] Force of a prismatic finger: under position commands its largest force, else at most `force`."""
    most, hand = largest_force(subject, name), subject.hand_joints.get(name)
    by_position = hand is not None and hand.settings.interface == "position"
    return most if by_position else min(force, most)


def _between_two(planner: Planner, end: PlanningState, joints: tuple[str, ...], down: Array) -> bool:
    """Whether exactly two level, opposed links with prismatic joints touch the carried object."""
    robot, kinematics = planner.robot, planner.kinematics
    if any(robot.joint(name).type != "prismatic" for name in joints):
        return False
    links = sorted(part.removeprefix("robot/") for part in touched_parts(planner, end) if part.startswith("robot/"))
    if len(links) != 2 or not set(links) <= moved_links(robot, joints):
        return False
    q = np.array(end.position)
    q[list(robot.indices(joints))] += NUDGE
    nudged = with_mimics(robot, q)
    motions = [kinematics.forward(nudged, link).p - kinematics.forward(end.position, link).p for link in links]
    first, second = (motion / np.linalg.norm(motion) for motion in motions)
    return abs(float(first @ down)) < LEVEL and float(first @ second) < LEVEL - 1.0


CHECK = Check(name="grip_friction", codes=("TASK241",), findings=findings, needs_plan=True)
