"""Joints for which zero is outside of the limits."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    written = elements_by_name(subject.description.root, "joint")
    for joint in subject.parts.joints:
        lower, upper = joint.limits.lower, joint.limits.upper
        if joint.independent and lower is not None and upper is not None and not lower <= 0.0 <= upper:
            message = f"joint '{joint.name}' moves from {lower:g} to {upper:g}: zero is outside"
            element = written[joint.name]
            place = (element.first("limit") or element).place
            yield Finding("URDF334", message, place, "state a named pose in the robot file", "note")


CHECK = Check(
    code="URDF334",
    name="zero-outside",
    tier="readiness",
    severity="note",
    summary="Zero is outside of the limits of a joint",
    reason=(
        "Programs that start a robot with all joints at zero start it where it cannot be; a pose `home` in the "
        "robot file says where to start."
    ),
    bad=one_joint('<limit lower="0.5" upper="1" velocity="1" effort="1"/>'),
    find=_find,
)
