"""Grasp forces above the largest force of a prismatic finger."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic
from manipcli.preflight.grips import (
    grasps,
    largest_force,
    sensible_force,
)
from manipcli.preflight.preflight import Check, Subject


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Grasps whose force, reduced for light objects, exceeds the largest force of a prismatic finger."""
    task, plan = subject.task, subject.plan
    for grasp in grasps(plan):
        for name in grasp.joints:
            most = largest_force(subject, name)
            if sensible_force(task, grasp.end, grasp.force) > most:
                message = f"step '{grasp.step}': force {grasp.force:.3g} N exceeds the {most:.3g} N of {name}"
                hint = "lower `force`, or raise the limit: the joint's effort, or `max_effort`"
                yield Diagnostic("TASK238", message, task.file.place("steps", grasp.index), hint, "warning")


CHECK = Check(name="grip_force_limit", codes=("TASK238",), findings=findings, needs_plan=True)
