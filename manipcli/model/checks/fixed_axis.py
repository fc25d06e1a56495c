"""Axes and mimics of fixed joints."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.samples import one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    for joint in subject.description.root.all("joint"):
        if joint.attributes.get("type") != "fixed":
            continue
        what = f"joint '{joint.attributes.get('name', '')}' is fixed; its"
        axis, mimic = joint.first("axis"), joint.first("mimic")
        if axis is not None:
            yield Finding("URDF104", f"{what} axis means nothing", axis.place, None, "note")
        if mimic is not None:
            message = f"{what} <mimic> of '{mimic.attributes.get('joint', '')}' means nothing"
            yield Finding("URDF104", message, mimic.place, "make the joint move, or delete <mimic>", "warning")


CHECK = Check(
    code="URDF104",
    name="fixed-axis",
    tier="physics",
    severity="warning",
    summary="A fixed joint has an axis, or follows another",
    reason="It means nothing; mostly the joint moved once. What should follow another joint stands still.",
    bad=one_joint('<axis xyz="0 0 1"/><mimic joint="k"/>', kind="fixed"),
    find=_find,
)
