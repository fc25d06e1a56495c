"""Hands whose references move faster than a joint may."""

from __future__ import annotations

import math
from collections.abc import Iterator

from manipcli.control.controllers import CONTROLLERS
from manipcli.core.errors import Diagnostic
from manipcli.core.text import told_apart
from manipcli.preflight.preflight import Check, Subject


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Hands whose references are to move faster than a joint may; the default never is."""
    task = subject.task
    for name, spec in task.controllers.controllers.items():
        hand = CONTROLLERS[spec.type].hand
        speed = None if hand is None else hand(spec).speed
        if speed is None:
            continue
        limits = {joint: task.robot.joint(joint).limits.velocity for joint in spec.joints}
        limit, joint = min((limit or math.inf, joint) for joint, limit in limits.items())
        if speed > limit:
            unit = f"{task.robot.joint(joint).unit}/s"
            swift, most = told_apart(speed, limit, form=".3g")
            message = f"{joint}: its references move at {swift} {unit}, its velocity limit is {most} {unit}"
            place = task.controllers_file.place("controllers", name, "speed")
            yield Diagnostic(
                "CTRL167", message, place, "without `speed` they move as fast as all joints may", "warning"
            )


CHECK = Check(name="closing_speed", codes=("CTRL167",), findings=findings, needs_physics=False)
