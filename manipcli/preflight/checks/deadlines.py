"""Timeouts of steps that are shorter than their planned motions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from manipcli.core.errors import Diagnostic
from manipcli.core.text import distinguished
from manipcli.plan.motion import Motion
from manipcli.preflight.preflight import Check, Subject
from manipcli.task.plan_steps import PlannedStep
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Steps and groups whose `timeout` is shorter than their motions."""
    task, plan = subject.task, subject.plan
    yield from _of_groups(task, plan)
    for planned in plan.every:
        k, step = planned.index, task.spec.steps[planned.index]
        least = sum(_least(motion) for motion in planned.plan.motions)
        if step.timeout is not None and least > step.timeout:
            takes, given = distinguished(least, step.timeout, form=".3g")
            message = f"step '{planned.id}' times out after {given} s, its plan takes {takes} s"
            hint = f"set `timeout` to more than {takes} s"
            yield Diagnostic("TASK243", message, task.file.place("steps", k, "timeout"), hint, "warning")


def _of_groups(task: Task, plan: Plan) -> Iterator[Diagnostic]:
    """Groups whose `timeout` is too short on every path through them, without choices and waits."""
    for k, block in enumerate(task.spec.blocks):
        if block.timeout is None:
            continue
        inside = range(block.first, block.last)
        paths = [[step for step in way.steps if step.index in inside] for way in plan.combinations]
        least = min((_time(path) for path in paths if path), default=0.0)
        if least > block.timeout:
            takes, given = distinguished(least, block.timeout, form=".3g")
            message = f"{block.word} '{block.id}' times out after {given} s, its plan takes {takes} s"
            hint = f"set `timeout` to more than {takes} s"
            yield Diagnostic("TASK243", message, task.file.place("blocks", k, "timeout"), hint, "warning")


def _time(path: Sequence[PlannedStep]) -> float:
    """[s] Least duration of successive steps; those at the same time count once."""
    total = last = 0.0
    for step in path:
        own = sum(_least(motion) for motion in step.plan.motions)
        total += max(0.0, own - last) if step.beside else own
        last = own
    return total


def _least(motion: Motion) -> float:
    """[s] Least duration: a closing hand and a guarded motion can end early."""
    if motion.guarded:
        return 0.0
    if motion.grip is not None:
        return 0.0 if motion.trajectory is None else motion.trajectory.duration
    return motion.duration


CHECK = Check(name="deadlines", codes=("TASK243",), findings=findings, needs_plan=True, needs_physics=False)
