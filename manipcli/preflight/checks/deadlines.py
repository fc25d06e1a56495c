"""Timeouts of steps that are shorter than their planned motions."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic
from manipcli.core.text import distinguished
from manipcli.plan.motion import Motion
from manipcli.preflight.preflight import Check, Subject


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Steps whose `timeout` is shorter than their motions."""
    task, plan = subject.task, subject.plan
    for planned in plan.every:
        k, step = planned.index, task.spec.steps[planned.index]
        least = sum(_least(motion) for motion in planned.plan.motions)
        if step.timeout is not None and least > step.timeout:
            takes, given = distinguished(least, step.timeout, form=".3g")
            message = f"step '{planned.id}' times out after {given} s, its plan takes {takes} s"
            hint = f"set `timeout` to more than {takes} s"
            yield Diagnostic("TASK243", message, task.file.place("steps", k, "timeout"), hint, "warning")


def _least(motion: Motion) -> float:
    """[s] Least duration: a closing hand and a guarded motion can end early."""
    if motion.guarded:
        return 0.0
    if motion.grip is not None:
        return 0.0 if motion.trajectory is None else motion.trajectory.duration
    return motion.duration


CHECK = Check(name="deadlines", codes=("TASK243",), findings=findings, needs_plan=True, needs_physics=False)
