"""Objects lifted by friction alone that are too heavy for it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.core.geometry import Array
from manipcli.core.units import readable
from manipcli.model.configuration import with_mimics
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
"""So many times its weight friction is to carry: it also accelerates what is carried, and keeps it from turning.
Measured with blocks between two fingers, lifted 10 cm: up to 1.6 none stays in the hand, at 2 few do, at 2.5 most."""
LEVEL: Final = 0.1
"""A finger whose way climbs less than this carries by friction alone."""
LIFTED: Final = 5e-3
"""[m] from which on what is held no longer rests."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """What is lifted between two level fingers that slide, where their friction, 2 mu F, is not clearly more than its
    weight.

    Of hands of more fingers, and of fingers that close from below, nothing is said: those also hold by their form.
    """
    task, plan = subject.task, subject.plan
    gravity = task.scene.gravity
    g = float(np.linalg.norm(gravity))
    if not g:
        return
    for one in grasps(plan):
        if one.end.carried is None:
            continue
        body = task.scene.body(one.end.carried.body)
        ends = [step.plan.end for step in plan.steps[one.index :]]
        carrying = itertools.takewhile(lambda end: end.carried is not None, ends)
        heights = [-float(plan.planner.body_pose(end, body.name).p @ gravity) / g for end in carrying]
        if max(heights) < heights[0] + LIFTED or not _between_two(plan.planner, one.end, one.joints, gravity / g):
            continue
        force = min(_held_force(subject, name, one.force) for name in one.joints)
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
            yield Diagnostic("TASK241", message, task.file.place("steps", one.index), hint, "warning")


def _held_force(subject: Subject, name: str, force: float) -> float:
    """[N] of a finger that slides: commanded by position it is all that it has, else no more than is asked."""
    most, hand = largest_force(subject, name), subject.hand_joints.get(name)
    by_position = hand is not None and hand.settings.interface == "position"
    return most if by_position else min(force, most)


def _between_two(planner: Planner, end: PlanningState, joints: tuple[str, ...], down: Array) -> bool:
    """Whether two links that slide, level and against each other, touch what is carried, and nothing else does."""
    robot, kinematics = planner.robot, planner.kinematics
    if any(robot.joint(name).type != "prismatic" for name in joints):
        return False
    links = sorted(part.removeprefix("robot/") for part in touched_parts(planner, end) if part.startswith("robot/"))
    if len(links) != 2 or not set(links) <= moved_links(robot, joints):
        return False
    q = np.array(end.position)
    q[list(robot.indices(joints))] += NUDGE
    nudged = with_mimics(robot, q)
    ways = [kinematics.forward(nudged, link).p - kinematics.forward(end.position, link).p for link in links]
    one, other = (way / np.linalg.norm(way) for way in ways)
    return abs(float(one @ down)) < LEVEL and float(one @ other) < LEVEL - 1.0


CHECK = Check(name="grip_friction", codes=("TASK241",), findings=findings, needs_plan=True)
