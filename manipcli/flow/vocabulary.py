"""The words of a task file: what the members of the seams add to the spec."""

from __future__ import annotations

from manipcli.model.conditions import CONDITIONS
from manipcli.plan.steps import STEPS
from manipcli.spec.task import TaskSpec
from manipcli.spec.unions import task_model


def task_spec() -> type[TaskSpec]:
    """`TaskSpec` with all verbs and conditions; the same class each time."""
    return task_model(STEPS, CONDITIONS)
