"""Round objects between two fingers, which may rotate about the line through the two contacts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.preflight.preflight import Check, Subject

ROUND: Final = ("cylinder", "cup")
"""Round bodies other than spheres."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Round objects held by two links with a point contact each.

    Measured with two flat fingers and 8 N: upright cylinders of 60 g rotate by 28 to 180 degrees while they are
    carried, and by less than one degree with a `spinning_friction` of 0.01.
    """
    task, plan = subject.task, subject.plan
    if task.robot.holding is not None:
        return
    for step in plan.every:
        end = step.plan.end
        if end.carried is None or not any(motion.grip is not None for motion in step.plan.motions):
            continue
        body = task.true.scene.body(end.carried.body)
        if body.kind not in ROUND or body.spinning_friction:
            continue
        hits = plan.planner.grasping(end, body.name).every(end.position)
        if len({part for hit in hits for part in (hit.a, hit.b)} - {body.name}) == 2:
            message = (
                f"step '{step.id}': '{body.name}' ({body.kind}) may rotate between the point contacts of two fingers"
            )
            hint = f"set `spinning_friction: 0.01` on '{body.name}' to model the contact area of real fingertips"
            yield Diagnostic("TASK240", message, task.file.place("steps", step.index), hint, "warning")


CHECK = Check(name="rotation_slip", codes=("TASK240",), findings=findings, needs_plan=True)
