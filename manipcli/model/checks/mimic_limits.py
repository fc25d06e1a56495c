"""Mimic joints that cannot follow."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import INERTIAL, LIMIT, one_joint

TOLERANCE: Final = 0.02
"""Of the range: descriptions round their numbers."""


def _find(subject: Subject) -> Iterator[Finding]:
    joints = {joint.name: joint for joint in subject.parts.joints}
    written = elements_by_name(subject.description.root, "joint")
    for joint in subject.parts.joints:
        mimic, own = joint.mimic, joint.limits
        if mimic is None or mimic.joint not in joints or own.lower is None or own.upper is None:
            continue
        leader = joints[mimic.joint].limits
        if leader.lower is None or leader.upper is None:
            continue
        ends = sorted(mimic.multiplier * end + mimic.offset for end in (leader.lower, leader.upper))
        slack = TOLERANCE * max(own.upper - own.lower, ends[1] - ends[0])
        if ends[0] >= own.lower - slack and ends[1] <= own.upper + slack:
            continue
        message = (
            f"joint '{joint.name}' follows '{mimic.joint}' from {ends[0]:.4g} to {ends[1]:.4g} "
            f"and has limits {own.lower:.4g} to {own.upper:.4g}"
        )
        element = written[joint.name]
        yield Finding("URDF335", message, (element.first("limit") or element).place, "widen them", "warning")


CHECK = Check(
    code="URDF335",
    name="mimic-limits",
    tier="readiness",
    severity="warning",
    summary="A mimic joint cannot follow its joint all the way: its own limits are narrower",
    reason=(
        "Either the coupling breaks at the limit or the limit does; a plan for the leading joint does not know of it."
    ),
    bad=one_joint(
        more='<link name="other">'
        + INERTIAL
        + '</link><joint name="k" type="revolute"><origin xyz="0 0 1"/><parent link="tip"/><child link="other"/>'
        + LIMIT
        + '<mimic joint="j" multiplier="2"/></joint>'
    ),
    find=_find,
)
