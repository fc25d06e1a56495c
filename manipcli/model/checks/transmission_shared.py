"""Joints with two transmissions."""

from collections.abc import Iterator

from manipcli.core.errors import Finding, Severity
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import WrittenTransmission, transmissions
from manipcli.model.robot import TransmissionTag
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
    yield from _unlike(subject)


def _unlike(subject: Subject) -> Iterator[Finding]:
    """Gears of ros2_control that are others than those that ROS 1 has of the same joints, which are read first."""
    first: dict[str, TransmissionTag] = {}
    for found, tag in zip(transmissions(subject), subject.parts.transmissions, strict=True):
        for joint in tag.joints:
            if found.ros1:
                first.setdefault(joint, tag)
            elif joint in first and _gear(first[joint]) != _gear(tag):
                message = (
                    f"transmission '{found.name}' of ros2_control is another gear for joint '{joint}' than "
                    f"'{first[joint].name}' of ROS 1, which counts"
                )
                yield Finding("URDF311", message, found.element.place, "make them alike, or take one out", "warning")
                break


def _gear(tag: TransmissionTag) -> tuple[object, ...]:
    """All but its names."""
    return tag.type, tag.joints, tag.joint_reductions, tag.joint_offsets, tag.actuator_reductions


CHECK = Check(
    code="URDF311",
    name="transmission-shared",
    tier="readiness",
    severity="error",
    summary="A joint or actuator belongs to two transmissions, or to two unlike ones of ROS 1 and ros2_control",
    reason="Each of them would set its position; which one wins depends on the order of loading.",
    bad=one_joint(more=transmission() + transmission().replace('"t"', '"u"')),
    find=_find,
)
