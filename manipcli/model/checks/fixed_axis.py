"""Axes of fixed joints."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.samples import one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    for joint in subject.description.root.all("joint"):
        axis = joint.first("axis")
        if joint.attributes.get("type") == "fixed" and axis is not None:
            message = f"joint '{joint.attributes.get('name', '')}' is fixed; its axis means nothing"
            yield Finding("URDF104", message, axis.place, None, "note")


CHECK = Check(
    code="URDF104",
    name="fixed-axis",
    tier="physics",
    severity="note",
    summary="A fixed joint has an axis",
    reason="It means nothing; mostly the joint moved once.",
    bad=one_joint('<axis xyz="0 0 1"/>', kind="fixed"),
    find=_find,
)
