"""Joints with two transmissions."""

from collections.abc import Iterator

from manipcli.core.errors import Finding, Severity
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import WrittenTransmission, transmissions
from manipcli.model.samples import one_joint, transmission


def _find(subject: Subject) -> Iterator[Finding]:
    """ROS 1 and ros2_control may describe the same gear, each in its own place: they are two lists.

    Two joints with an actuator of one name are two motors with a name copied, which does no harm in joint space.
    """
    owners: dict[tuple[bool, str, str], WrittenTransmission] = {}
    for found in transmissions(subject):
        shared_joint = False
        for tag, elements in (("joint", found.joints), ("actuator", found.actuators)):
            for element in elements:
                name = element.attributes.get("name", "").strip()
                owner = owners.setdefault((found.ros1, tag, name), found)
                if not name or owner is found or shared_joint:
                    continue
                shared_joint = tag == "joint"
                severity: Severity = "error" if shared_joint else "warning"
                message = f"transmission '{found.name}': {tag} '{name}' belongs to transmission '{owner.name}' already"
                yield Finding("URDF311", message, element.place, f"a {tag} has one transmission", severity)


CHECK = Check(
    code="URDF311",
    name="transmission-shared",
    tier="readiness",
    severity="error",
    summary="A joint or actuator belongs to two transmissions",
    reason="Each of them would set its position; which one wins depends on the order of loading.",
    bad=one_joint(more=transmission() + transmission().replace('"t"', '"u"')),
    find=_find,
)
