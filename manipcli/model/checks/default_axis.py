"""Moving joints without an axis."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.samples import one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    for joint in subject.description.root.all("joint"):
        axis = joint.first("axis")
        if joint.attributes.get("type") in ("revolute", "continuous", "prismatic") and (
            axis is None or "xyz" not in axis.attributes
        ):
            message = f"joint '{joint.attributes.get('name', '')}' states no axis: it moves about or along x"
            yield Finding("URDF105", message, joint.place, '<axis xyz="..."/>', "note")


CHECK = Check(
    code="URDF105",
    name="default-axis",
    tier="physics",
    severity="note",
    summary="A moving joint has no axis; x is used",
    reason="URDF says x; whoever meant z does not see it before the robot moves.",
    bad=one_joint(),
    find=_find,
)
