"""Limits of angle that look like degrees."""

from collections.abc import Iterator
from math import radians
from typing import Final

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import one_joint

MANY: Final = 20.0
"""[rad]: more than three turns."""


def _find(subject: Subject) -> Iterator[Finding]:
    written = elements_by_name(subject.description.root, "joint")
    for joint in subject.parts.joints:
        lower, upper = joint.limits.lower or 0.0, joint.limits.upper or 0.0
        if joint.type != "revolute" or max(abs(lower), abs(upper)) <= MANY or max(abs(lower), abs(upper)) > 720.0:
            continue
        message = f"joint '{joint.name}' turns from {lower:g} to {upper:g} rad: are these degrees?"
        hint = f'lower="{radians(lower):.4f}" upper="{radians(upper):.4f}"; many turns: type continuous'
        element = written[joint.name]
        yield Finding("URDF109", message, (element.first("limit") or element).place, hint, "warning")


CHECK = Check(
    code="URDF109",
    name="limits-in-degrees",
    tier="physics",
    severity="warning",
    summary="A revolute joint has limits that look like degrees",
    reason="URDF counts in radians: a limit of 180 lets the joint turn 28 times.",
    bad=one_joint('<limit lower="-180" upper="180" velocity="1" effort="1"/>'),
    find=_find,
)
