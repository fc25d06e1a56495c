"""The words of task and controllers files: what the members of the seams add to the specs."""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.conditions.members import CONDITIONS
from manipcli.control.controllers import CONTROLLERS
from manipcli.plan.steps import STEPS
from manipcli.spec.base import about
from manipcli.spec.condition import COMBINATIONS, QUANTIFIERS
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.task import TaskSpec
from manipcli.spec.unions import controllers_model, task_model


def task_spec() -> type[TaskSpec]:
    """`TaskSpec` with all verbs and conditions; the same class each time."""
    return task_model(STEPS, CONDITIONS)


def controllers_spec() -> type[ControllersSpec]:
    """`ControllersSpec` with all types of controllers; the same class each time."""
    return controllers_model(CONTROLLERS)


def meanings(kind: str) -> Mapping[str, str]:
    """What each word of a kind of `flow.check.words` means, in one line; empty where the words alone are told."""
    conditions = {one.name: about(one.spec) for one in CONDITIONS} | COMBINATIONS
    told = {
        "steps": {one.name: about(one.spec) for one in STEPS},
        "conditions": conditions,
        "expectations": conditions | QUANTIFIERS,
    }
    return told.get(kind, {})
