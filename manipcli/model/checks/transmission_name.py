"""Transmissions without a name."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import transmissions
from manipcli.model.samples import one_joint, transmission


def _find(subject: Subject) -> Iterator[Finding]:
    seen: set[tuple[bool, str]] = set()
    for found in transmissions(subject):
        name = found.element.attributes.get("name", "").strip()
        if not name:
            yield Finding("URDF317", f"a {found.type} has no name", found.element.place, 'name="..."')
        elif (found.ros1, name) in seen:
            yield Finding("URDF317", f"transmission '{name}' is written twice", found.element.place, None)
        seen.add((found.ros1, name))


CHECK = Check(
    code="URDF317",
    name="transmission-name",
    tier="readiness",
    severity="error",
    summary="A transmission has no name, or one that another has",
    reason="ros_control and ros2_control find transmissions by name, and load no other.",
    bad=one_joint(more=transmission().replace(' name="t"', "")),
    find=_find,
)
