"""Transmissions with a wrong number of joints or actuators."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import SIZES, transmissions
from manipcli.model.samples import GEARED, MOTOR, one_joint, transmission


def _find(subject: Subject) -> Iterator[Finding]:
    """In ros2_control the actuator may be left out of a simple one."""
    for found in transmissions(subject):
        count = SIZES.get(found.type)
        joints, actuators = len(found.joints), len(found.actuators)
        if count is None or joints == 0 or (joints == actuators == count):
            continue
        if not found.ros1 and joints == count == 1 and actuators == 0:
            continue
        message = f"transmission '{found.name}' has {joints} joints and {actuators} actuators; expected {count} each"
        yield Finding("URDF313", message, found.element.place, None)


CHECK = Check(
    code="URDF313",
    name="transmission-count",
    tier="readiness",
    severity="error",
    summary="A transmission does not have as many joints and actuators as its type takes",
    reason=(
        "A simple one has one of each, a differential and a four-bar linkage two; ros_control does not load another."
    ),
    bad=one_joint(more=transmission(GEARED + MOTOR + MOTOR.replace('"m"', '"n"'))),
    find=_find,
)
