"""Joints with two transmissions."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import transmissions
from manipcli.model.samples import one_joint, transmission


def _find(subject: Subject) -> Iterator[Finding]:
    """ROS 1 and ros2_control may describe the same gear, each in its own place: they are two lists."""
    first: dict[tuple[bool, str, str], str] = {}
    for found in transmissions(subject):
        told = False
        for tag, elements in (("joint", found.joints), ("actuator", found.actuators)):
            for element in elements:
                name = element.attributes.get("name", "").strip()
                other = first.setdefault((found.ros1, tag, name), found.name + str(id(found.element)))
                if name and other != found.name + str(id(found.element)) and not told:
                    told = True
                    message = f"transmission '{found.name}': {tag} '{name}' belongs to another transmission already"
                    yield Finding("URDF311", message, element.place, "a joint has one transmission")


CHECK = Check(
    code="URDF311",
    name="transmission-shared",
    tier="readiness",
    severity="error",
    summary="A joint or actuator belongs to two transmissions",
    reason="Each of them would set its position; which one wins depends on the order of loading.",
    bad=one_joint(more=2 * transmission()),
    find=_find,
)
