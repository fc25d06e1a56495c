"""Position-commanded hands that press with more force than a grasp asks for."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits
from manipcli.plan.hand import fingers
from manipcli.preflight.grips import (
    Grasp,
    closing_rate,
    effort_per_force,
    grasps,
    touched_parts,
)
from manipcli.preflight.preflight import Check, Subject
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task

MUCH: Final = 1.1
"""Largest ratio of the pressed to the asked force without a warning."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Grasps with less force than the motors of a position-commanded hand press with.

    Such a motor follows its reference with up to its effort limit. The reference stops where a finger measures the
    force, which is already inside the object, so the finger presses with its effort limit.
    """
    task, plan = subject.task, subject.plan
    reported: set[str] = set()
    for grasp in grasps(plan):
        for name in grasp.joints:
            hand = subject.hand_joints.get(name)
            if hand is None or hand.settings.interface != "position" or name in reported:
                continue
            shared = _effort_each(task, plan, grasp, name)
            limit = task.robot.joint(name).limits.effort or math.inf
            if not shared or limit / shared <= MUCH * grasp.force:
                continue
            reported.add(name)
            given = (
                f"{limit / shared:.3g} N (its effort limit)"
                if limit < math.inf
                else "unlimited force (no effort limit)"
            )
            message = f"{name}: presses with {given}, step '{grasp.step}' asks for {grasp.force:.3g} N: "
            message += "under position commands `force` is only the contact force at which it stops"
            lower = f"limits.{name}.effort: {digits(1.05 * shared * grasp.force)}"
            hint = f"use effort commands, or lower the effort limit (robot file, {lower})"
            place = task.controllers_file.place("controllers", hand.controller, "command_interface")
            yield Diagnostic("CTRL173", message, place, hint, "warning")


def _effort_each(task: Task, plan: Plan, grasp: Grasp, name: str) -> float:
    """The effort of a joint [N m or N] per newton of its finger; 0 if unknown."""
    if task.robot.joint(name).type == "prismatic":
        return effort_per_force(task, name)
    if grasp.end.carried is None or (grasp.joints.index(name),) not in fingers(task.robot, grasp.joints):
        return 0.0
    return closing_rate(plan.planner, grasp.end, name, touched_parts(plan.planner, grasp.end))


CHECK = Check(name="position_grips", codes=("CTRL173",), findings=findings, needs_plan=True)
