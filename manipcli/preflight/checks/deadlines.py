"""Timeouts of steps that end before the planned motions do."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic
from manipcli.core.text import told_apart
from manipcli.plan.motion import Motion
from manipcli.preflight.preflight import Check, Subject


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Steps whose `timeout` is over before their motions can be."""
    task, plan = subject.task, subject.plan
    for k, (step, planned) in enumerate(zip(task.spec.steps, plan.steps, strict=True)):
        least = sum(_least(motion) for motion in planned.plan.motions)
        if step.timeout is not None and least > step.timeout:
            takes, given = told_apart(least, step.timeout, form=".3g")
            message = f"step '{planned.id}' is planned to take {takes} s, and times out after {given} s"
            hint = f"give it more than {takes} s"
            yield Diagnostic("TASK243", message, task.file.place("steps", k, "timeout"), hint, "warning")


def _least(motion: Motion) -> float:
    """How long [s] it takes at least: nobody knows when a hand has closed, or what is guarded comes upon something."""
    if motion.guarded:
        return 0.0
    if motion.grip is not None:
        return 0.0 if motion.trajectory is None else motion.trajectory.duration
    return motion.duration


CHECK = Check(name="deadlines", codes=("TASK243",), findings=findings, needs_plan=True, needs_physics=False)
