"""Transmissions without a known hardware interface."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.core.text import did_you_mean
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import WrittenTransmission, transmissions
from manipcli.model.samples import MOTOR, one_joint, transmission

KNOWN: Final = (
    "JointStateInterface",
    "PositionJointInterface",
    "VelocityJointInterface",
    "EffortJointInterface",
    "PosVelJointInterface",
    "PosVelAccJointInterface",
    "PosVelTorqueGainsJointInterface",
)


def _find(subject: Subject) -> Iterator[Finding]:
    """The name may carry the prefix `hardware_interface/`; without it, it is old but read."""
    for found in transmissions(subject):
        for joint in found.joints if found.ros1 else ():
            name = joint.attributes.get("name", "")
            interfaces = joint.all("hardwareInterface")
            if not interfaces:
                message = f"transmission '{found.name}': joint '{name}' has no <hardwareInterface>"
                hint = f"<hardwareInterface>hardware_interface/{_meant(found)}</hardwareInterface>"
                yield Finding("URDF314", message, joint.place, hint, "warning")
            for interface in interfaces:
                word = interface.text.strip()
                if word.rpartition("/")[2] not in KNOWN:
                    message = f"transmission '{found.name}': joint '{name}' has the unknown hardware interface '{word}'"
                    near = did_you_mean(word.rpartition("/")[2], list(KNOWN))
                    yield Finding("URDF314", message, interface.place, near, "warning")


def _meant(found: WrittenTransmission) -> str:
    """What an actuator of it says, as old descriptions do; else position."""
    said = (word.text.strip().rpartition("/")[2] for one in found.actuators for word in one.all("hardwareInterface"))
    return next((word for word in said if word in KNOWN), "PositionJointInterface")


CHECK = Check(
    code="URDF314",
    name="hardware-interface",
    tier="readiness",
    severity="warning",
    summary="A joint of a ROS 1 transmission has no hardware interface, or an unknown one",
    reason="ros_control then leaves the joint out without an error; no controller finds it.",
    bad=one_joint(more=transmission('<joint name="j"/>' + MOTOR)),
    find=_find,
)
