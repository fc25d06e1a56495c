"""Limits of angle that look like degrees, and of way that look like millimetres."""

from collections.abc import Iterator
from math import radians
from typing import Final

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import one_joint

MANY: Final = 20.0
"""[rad]: more than three turns."""
FAR: Final = 20.0
"""[m]"""


def _find(subject: Subject) -> Iterator[Finding]:
    written = elements_by_name(subject.description.root, "joint")
    for joint in subject.parts.joints:
        lower, upper = joint.limits.lower or 0.0, joint.limits.upper or 0.0
        element = written[joint.name]
        place = (element.first("limit") or element).place
        most = max(abs(lower), abs(upper))
        if joint.type == "prismatic" and most > FAR:
            message = f"joint '{joint.name}' slides from {lower:g} to {upper:g} m: are these millimetres?"
            hint = f'lower="{lower / 1000.0:g}" upper="{upper / 1000.0:g}"'
            yield Finding("URDF109", message, place, hint, "warning")
        if joint.type != "revolute" or most <= MANY or most > 720.0:
            continue
        message = f"joint '{joint.name}' turns from {lower:g} to {upper:g} rad: are these degrees?"
        hint = f'lower="{radians(lower):.4f}" upper="{radians(upper):.4f}"; many turns: type continuous'
        yield Finding("URDF109", message, place, hint, "warning")


CHECK = Check(
    code="URDF109",
    name="limits-in-degrees",
    tier="physics",
    severity="warning",
    summary="A joint has limits that look like degrees, or like millimetres",
    reason="URDF counts in radians and metres: a limit of 180 lets a joint turn 28 times, or slide 180 m.",
    bad=one_joint('<limit lower="-180" upper="180" velocity="1" effort="1"/>'),
    find=_find,
)
