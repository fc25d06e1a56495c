"""Round objects between two fingers, which may turn about the line through the two contacts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.preflight.preflight import Check, Subject

ROUND: Final = ("cylinder", "cup")
"""Kinds that are round and not the same from all sides."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Round things that two links hold by a point each, about which they turn.

    Measured with two flat fingers and 8 N: upright cylinders of 60 g turn by 28 to 180 degrees while they are carried,
    by less than one with a `spinning_friction` of 0.01.
    """
    task, plan = subject.task, subject.plan
    for k, step in enumerate(plan.steps):
        end = step.plan.end
        if end.carried is None or not any(motion.grip is not None for motion in step.plan.motions):
            continue
        body = task.true.scene.body(end.carried.body)
        if body.kind not in ROUND or body.spinning_friction:
            continue
        hits = plan.planner.grasping(end, body.name).every(end.position)
        if len({part for hit in hits for part in (hit.a, hit.b)} - {body.name}) == 2:
            message = (
                f"step '{step.id}': two fingers hold '{body.name}', a {body.kind}, by a point each: it may turn there"
            )
            hint = f"`spinning_friction: 0.01` of '{body.name}' stands for the area of real fingertips"
            yield Diagnostic("TASK240", message, task.file.place("steps", k), hint, "warning")


CHECK = Check(name="rotation_slip", codes=("TASK240",), findings=findings, needs_plan=True)
