"""Objects that are grasped although the robot knows only roughly where they are."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic
from manipcli.core.text import escape
from manipcli.plan.steps.grasp import GraspSpec
from manipcli.plan.steps.locate import LocateSpec
from manipcli.plan.steps.pick import PickSpec
from manipcli.task.task import Task


def unlocated(task: Task) -> Iterator[Diagnostic]:
    """TASK326: an object with `known` is grasped before it was located."""
    located: set[str] = set()
    for k, step in enumerate(task.spec.steps):
        if isinstance(step.body, LocateSpec):
            located.add(step.body.object)
        elif isinstance(step.body, PickSpec | GraspSpec):
            name = step.body.object
            body = None if name is None else task.spec.scene.get(name)
            if name is None or body is None or body.known is None or name in located:
                continue
            located.add(name)
            message = f"'{escape(name)}' is grasped where it is believed: it has `known`, and was not located before"
            hint = f"add a step before it: `locate: {{object: {escape(name)}, with: CAMERA}}`"
            yield task.file.source.finding(
                326, ("steps", k, step.verb, "object"), message, hint=hint, severity="warning"
            )
