"""Goal tolerances that the motors of an engine do not reach: the goal would be aborted after its goal time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits
from manipcli.preflight.preflight import Check, ControlledJoint, Subject, once
from manipcli.spec.controllers import ConstraintsSpec

REACHED: Final = 1e-5
"""[rad or m] Motors commanded by position or velocity hold a joint under load within this; measured in PyBullet."""


def findings(subject: Subject) -> Iterator[Diagnostic]:
    """Joints commanded by position or velocity; the sag of PID loops on effort is that of `insufficient_effort`."""
    yield from once(found for shift in subject.shifts for joint in shift.servos for found in _of(subject, joint))


def _of(subject: Subject, joint: ControlledJoint) -> Iterator[tuple[str, Diagnostic]]:
    constraints = getattr(subject.task.controllers.controllers[joint.controller], "constraints", None)
    own = constraints.joints.get(joint.name) if isinstance(constraints, ConstraintsSpec) else None
    if own is None or own.goal is None or own.goal >= REACHED:
        return
    unit = subject.task.robot.joint(joint.name).unit
    place = subject.task.controllers_file.place(
        "controllers", joint.controller, "constraints", "joints", joint.name, "goal"
    )
    message = f"{joint.name}: its goal tolerance of {digits(own.goal)} {unit} may never be reached: "
    message += f"motors hold a joint under load within about {digits(REACHED)} {unit}"
    yield joint.name, Diagnostic("CTRL221", message, place, f"write `goal: {digits(REACHED)}` or more", "warning")


CHECK = Check(name="goal_tolerances", codes=("CTRL221",), findings=findings)
