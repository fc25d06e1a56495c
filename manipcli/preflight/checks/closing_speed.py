"""Closing speeds of hands above the velocity limit of a joint."""

from __future__ import annotations

import math
from collections.abc import Iterator

from manipcli.control.controllers import CONTROLLERS
from manipcli.core.errors import Diagnostic
from manipcli.core.text import distinguished
from manipcli.preflight.preflight import Check, Subject


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Hands with a `speed` above the velocity limit of a joint; the default speed keeps the limits."""
    task = subject.task
    for name, spec in task.controllers.controllers.items():
        hand = CONTROLLERS[spec.type].hand
        speed = None if hand is None else hand(spec).speed
        if speed is None:
            continue
        limits = {joint: task.robot.joint(joint).limits.velocity for joint in spec.joints}
        limit, joint = min((most or math.inf, joint) for joint, most in limits.items())
        if speed > limit:
            unit = f"{task.robot.joint(joint).unit}/s"
            closing, most = distinguished(speed, limit, form=".3g")
            message = f"{joint}: closing speed {closing} {unit} exceeds its velocity limit {most} {unit}"
            place = task.controllers_file.place("controllers", name, "speed")
            yield Diagnostic(
                "CTRL167",
                message,
                place,
                "remove `speed`: the default keeps the velocity limits of all joints",
                "warning",
            )


CHECK = Check(name="closing_speed", codes=("CTRL167",), findings=findings, needs_physics=False)
