"""Hands commanded by position that press with more force than a grasp asks for."""

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
"""So many times the force that is asked, and a hand that cannot be told it is told of."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Hands that are commanded by position and asked for less force than their motors press with.

    Such a motor follows its reference with all the effort that it may have. The reference stops where a finger feels
    the force, and there it is within the object already: what the finger presses with is the limit of its effort.
    """
    task, plan = subject.task, subject.plan
    told: set[str] = set()
    for one in grasps(plan):
        for name in one.joints:
            hand = subject.hand_joints.get(name)
            if hand is None or hand.settings.interface != "position" or name in told:
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
            place = task.controllers_file.place("controllers", hand.controller, "command_interface")
            yield Diagnostic("CTRL171", message, place, hint, "warning")


def _effort_each(task: Task, plan: Plan, grasp: Grasp, name: str) -> float:
    """The effort of a joint [N m or N] for each newton of its finger; 0 where that is not known."""
    if task.robot.joint(name).type == "prismatic":
        return effort_per_force(task, name)
    if grasp.end.carried is None or (grasp.joints.index(name),) not in fingers(task.robot, grasp.joints):
        return 0.0
    return closing_rate(plan.planner, grasp.end, name, touched_parts(plan.planner, grasp.end))


CHECK = Check(name="position_grips", codes=("CTRL171",), findings=findings, needs_plan=True)
