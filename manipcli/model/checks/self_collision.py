"""Links that overlap with all joints at zero."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import CUBE, INERTIAL, LIMIT, one_joint
from manipcli.model.zero_overlap import overlaps_at_zero


def _find(subject: Subject) -> Iterator[Finding]:
    links = elements_by_name(subject.description.root, "link")
    for a, b, depth in overlaps_at_zero(subject.parts):
        message = f"links '{a}' and '{b}' overlap (their hulls by {depth * 1000.0:.1f} mm) with all joints at zero"
        hint = "check their <origin> and sizes, or list the pair under collision_ignore in the robot file"
        yield Finding("URDF333", message, links[a].place if a in links else None, hint, "warning")


CHECK = Check(
    code="URDF333",
    name="self-collision",
    tier="readiness",
    severity="warning",
    summary="Links that are not neighbours overlap with all joints at zero",
    reason=(
        "Often a misplaced or oversized shape; planning then allows the pair everywhere, as the robot seems to "
        "be made like that."
    ),
    bad=one_joint(
        more='<link name="other">'
        + INERTIAL
        + CUBE
        + '</link><joint name="k" type="revolute"><origin xyz="0 0 1"/><parent link="tip"/><child link="other"/>'
        + LIMIT
        + '</joint><link name="last">'
        + INERTIAL
        + CUBE
        + '</link><joint name="l" type="revolute"><origin xyz="0 0 -0.9"/><parent link="other"/><child link="last"/>'
        + LIMIT
        + "</joint>"
    ),
    find=_find,
)
