"""Reductions of simple transmissions at the end that is not read."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import transmissions
from manipcli.model.samples import MOTOR, one_joint, transmission
from manipcli.model.urdf_numbers import finite

_UNREAD = (
    '<joint name="j"><hardwareInterface>PositionJointInterface</hardwareInterface>'
    "<mechanicalReduction>50</mechanicalReduction></joint>"
)


def _find(subject: Subject) -> Iterator[Finding]:
    for found in transmissions(subject):
        if found.type != "SimpleTransmission":
            continue
        read = "actuator" if found.ros1 else "joint"
        for element in found.joints if found.ros1 else found.actuators:
            child = element.first("mechanicalReduction") or element.first("mechanical_reduction")
            if child is None or finite(child.text) in (None, 1.0):
                continue
            message = f"transmission '{found.name}': the reduction {child.text} of its {element.tag} is not read"
            yield Finding("URDF318", message, child.place, f"write it at the {read}", "warning")


CHECK = Check(
    code="URDF318",
    name="transmission-unread",
    tier="readiness",
    severity="warning",
    summary="A simple transmission states a reduction where nobody reads it",
    reason=(
        "ros_control reads the reduction of the actuator, ros2_control that of the joint; each leaves the other out "
        "without a word, and so is done here."
    ),
    bad=one_joint(more=transmission(_UNREAD + MOTOR)),
    find=_find,
)
