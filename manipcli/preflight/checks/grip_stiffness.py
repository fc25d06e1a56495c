"""Grasps with more force than the springs of the fingers' gains give."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits
from manipcli.plan.hand import fingers
from manipcli.preflight.grips import (
    closing_rate,
    grasps,
    largest_force,
    sensible_force,
    touched_parts,
)
from manipcli.preflight.preflight import Check, Subject

ENOUGH: Final = 1.01
"""A force that is asked beyond this share of what there is is not met."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Grasps with more force than the spring of a finger's gain gives, all the way from the object to the posture.

    A finger of one joint, alone or with others that mimic it, gives p |q_posture - q_object| of effort, and by virtual
    work that over `_closing` of force. It is asked for what a light object and the force limit leave of the force.
    """
    task, plan = subject.task, subject.plan
    for one in grasps(plan):
        if one.end.carried is None:
            continue
        touched = touched_parts(plan.planner, one.end)
        for name, target in zip(one.joints, one.target, strict=True):
            hand = subject.hand_joints.get(name)
            if hand is None or hand.settings.interface != "effort":
                continue
            if (one.joints.index(name),) not in fingers(task.robot, one.joints):
                continue
            gains = hand.gains
            closing = closing_rate(plan.planner, one.end, name, touched)
            way = abs(float(target) - float(one.end.position[task.robot.joint_names.index(name)]))
            asked = min(sensible_force(task, one.end, one.force), largest_force(subject, name))
            if not closing or not way or gains.i or asked <= ENOUGH * gains.p * way / closing:
                continue
            given = f"p {digits(gains.p)} gives about {gains.p * way / closing:.2g} N"
            message = f"{name}: step '{one.step}' grasps with {one.force:.3g} N; {given}"
            than = "that" if asked == one.force else f"{asked:.3g} N"
            hint = f"p {digits(1.2 * asked * closing / way)} gives a fifth more than {than}"
            place = task.controllers_file.place("controllers", hand.controller, "gains", name)
            yield Diagnostic("CTRL168", message, place, hint, "warning")


CHECK = Check(name="grip_stiffness", codes=("CTRL168",), findings=findings, needs_plan=True)
