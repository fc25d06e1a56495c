"""Transmissions of joints that nobody commands."""

from collections.abc import Iterator

from manipcli.core.errors import Finding, Severity
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import transmissions
from manipcli.model.samples import one_joint, transmission


def _find(subject: Subject) -> Iterator[Finding]:
    joints = {joint.name: joint for joint in subject.parts.joints}
    for found in transmissions(subject):
        for element in found.joints:
            joint = joints.get(element.attributes.get("name", "").strip())
            if joint is None or joint.independent:
                continue
            severity: Severity = "warning" if joint.moves else "error"
            what = f"follows '{joint.mimic.joint}' (mimic)" if joint.mimic is not None else "is fixed"
            message = f"transmission '{found.name}' drives joint '{joint.name}', which {what}"
            yield Finding("URDF315", message, element.place, "take the transmission out", severity)


CHECK = Check(
    code="URDF315",
    name="transmission-joint",
    tier="readiness",
    severity="error",
    summary="A transmission drives a fixed joint or one that follows another",
    reason=(
        "A fixed joint does not move, and a mimic joint has no actuator of its own: its position is that of the "
        "joint it follows."
    ),
    bad=one_joint(kind="fixed", inside="", more=transmission()),
    find=_find,
)
