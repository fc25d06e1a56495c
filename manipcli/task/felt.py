"""The felt force of tasks with compliant steps, as conditions see it."""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.conditions.sensed import FELT, FELT_FORCE, NO_SENSORS, Sensed
from manipcli.plan.steps import STEPS
from manipcli.spec.task import TaskSpec


def complies(task: TaskSpec) -> bool:
    """Whether a step of the task is compliant, so that the arm has a compliant controller."""
    return any(STEPS[step.verb].compliant(step.body) for step in task.steps)


def felt(task: TaskSpec) -> Mapping[str, Sensed]:
    """The felt force by its name; empty for a task without compliant steps."""
    return {FELT: FELT_FORCE} if complies(task) else NO_SENSORS
