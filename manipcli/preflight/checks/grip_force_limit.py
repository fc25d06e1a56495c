"""Grasps with more force than a sliding finger can press with."""

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
    """Grasps with more force than a finger that slides can press with, also once it is reduced for a light object."""
    task, plan = subject.task, subject.plan
    for one in grasps(plan):
        for name in one.joints:
            most = largest_force(subject, name)
            if sensible_force(task, one.end, one.force) > most:
                message = f"step '{one.step}': a grasp with {one.force:.3g} N; {name} presses with {most:.3g} N at most"
                hint = "lower `force`, or raise what limits it: the joint's effort, or `max_effort`"
                yield Diagnostic("TASK238", message, task.file.place("steps", one.index), hint, "warning")


CHECK = Check(name="grip_force_limit", codes=("TASK238",), findings=findings, needs_plan=True)
