"""Grasp forces above what the p gains of the fingers give."""

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
"""Largest ratio of the asked to the available force without a warning."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Grasps with more force than the p gain of a finger gives between the object and the posture.

    A finger of one joint, with or without mimic joints, has the effort p |q_posture - q_object|, and by virtual work
    this over the closing rate as force. The needed force is that of the step, reduced for light objects and by the
    largest force of the finger.
    """
    task, plan = subject.task, subject.plan
    for grasp in grasps(plan):
        if grasp.end.carried is None:
            continue
        touched = touched_parts(plan.planner, grasp.end)
        for name, target in zip(grasp.joints, grasp.target, strict=True):
            hand = subject.hand_joints.get(name)
            if hand is None or hand.settings.interface != "effort":
                continue
            if (grasp.joints.index(name),) not in fingers(task.robot, grasp.joints):
                continue
            gains = hand.gains
            closing = closing_rate(plan.planner, grasp.end, name, touched)
            travel = abs(float(target) - float(grasp.end.position[task.robot.joint_names.index(name)]))
            asked = min(sensible_force(task, grasp.end, grasp.force), largest_force(subject, name))
            if not closing or not travel or gains.i or asked <= ENOUGH * gains.p * travel / closing:
                continue
            given = f"p {digits(gains.p)} gives about {gains.p * travel / closing:.2g} N"
            message = f"{name}: {given}, step '{grasp.step}' asks for {grasp.force:.3g} N"
            hint = f"raise p to {digits(1.2 * asked * closing / travel)} for 20 % more than {asked:.3g} N"
            place = task.controllers_file.place("controllers", hand.controller, "gains", name)
            yield Diagnostic("CTRL168", message, place, hint, "warning")


CHECK = Check(name="grip_stiffness", codes=("CTRL168",), findings=findings, needs_plan=True)
