"""Checks of transmissions that ros_control or ros2_control would not load, or would load differently."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic, Severity
from manipcli.core.text import did_you_mean
from manipcli.description.elements import TransmissionTag
from manipcli.description.lint.check import Subject, check
from manipcli.description.lint.control_tags import SIZES, WrittenTransmission, transmissions
from manipcli.description.lint.samples import GEARED, MOTOR, another, one_joint, transmission
from manipcli.description.urdf.joint import role
from manipcli.description.urdf.numbers import finite

INTERFACES: Final = (
    "JointStateInterface",
    "PositionJointInterface",
    "VelocityJointInterface",
    "EffortJointInterface",
    "PosVelJointInterface",
    "PosVelAccJointInterface",
    "PosVelTorqueGainsJointInterface",
)
_UNREAD = (
    '<joint name="j"><hardwareInterface>PositionJointInterface</hardwareInterface>'
    "<mechanicalReduction>50</mechanicalReduction></joint>"
)


@check(
    "URDF310", "transmission-type", "readiness", "warning", bad=one_joint(more=transmission(kind="Simpletransmission"))
)
def _type(subject: Subject) -> Iterator[Diagnostic]:
    """A transmission has an unknown type.

    It is ignored: commands go to the joint as if there were no gear.
    """
    for found in transmissions(subject):
        if found.type not in SIZES:
            kind = found.element.first("type") or found.element.first("plugin") or found.element
            message = f"transmission '{found.name}' has the unknown type '{found.type}'"
            hint = did_you_mean(found.type, list(SIZES)) or "known: " + ", ".join(SIZES)
            yield Diagnostic("URDF310", message, kind.place, hint, "warning")


@check(
    "URDF311",
    "transmission-shared",
    "readiness",
    bad=one_joint(more=transmission() + transmission().replace('"t"', '"u"')),
)
def _shared(subject: Subject) -> Iterator[Diagnostic]:
    """A joint or actuator belongs to two transmissions, or ROS 1 and ros2_control describe it differently.

    Each transmission would set its position; which one takes effect depends on the order of loading.
    """
    # ROS 1 and ros2_control may both describe the same gear, so each has its own list. Two joints whose actuators have
    # the same name are two motors with a copied name, which is harmless in joint space.
    owners: dict[tuple[bool, str, str], WrittenTransmission] = {}
    for found in transmissions(subject):
        shared_joint = False
        for tag, elements in (("joint", found.joints), ("actuator", found.actuators)):
            for element in elements:
                name = element.name
                owner = owners.setdefault((found.ros1, tag, name), found)
                if not name or owner is found or shared_joint:
                    continue
                shared_joint = tag == "joint"
                severity: Severity = "error" if shared_joint else "warning"
                message = f"transmission '{found.name}': {tag} '{name}' already belongs to transmission '{owner.name}'"
                yield Diagnostic("URDF311", message, element.place, f"use one transmission per {tag}", severity)
    yield from _contradictions(subject)


def _contradictions(subject: Subject) -> Iterator[Diagnostic]:
    """Gears of ros2_control that differ from the ROS 1 gears of the same joints, which take precedence."""
    first: dict[str, TransmissionTag] = {}
    for found, tag in zip(transmissions(subject), subject.parts.transmissions, strict=True):
        for joint in tag.joints:
            if found.ros1:
                first.setdefault(joint, tag)
            elif joint in first and _gear(first[joint]) != _gear(tag):
                message = (
                    f"transmission '{found.name}' of ros2_control differs at joint '{joint}' from "
                    f"'{first[joint].name}' of ROS 1, which is used"
                )
                yield Diagnostic("URDF311", message, found.element.place, "make them equal, or remove one", "warning")
                break


def _gear(tag: TransmissionTag) -> tuple[object, ...]:
    """Everything but the names."""
    return tag.type, tag.joints, tag.joint_reductions, tag.joint_offsets, tag.actuator_reductions


@check(
    "URDF312",
    "transmission-roles",
    "readiness",
    bad=one_joint(
        more=another(origin="")
        + '<transmission name="t"><type>transmission_interface/DifferentialTransmission</type>'
        + "".join(
            f'<joint name="{name}"><hardwareInterface>EffortJointInterface</hardwareInterface></joint>'
            f'<actuator name="m{name}"><mechanicalReduction>1</mechanicalReduction></actuator>'
            for name in "jk"
        )
        + "</transmission>"
    ),
)
def _roles(subject: Subject) -> Iterator[Diagnostic]:
    """The roles of joints and actuators of a transmission are missing or wrong.

    A differential or a four-bar linkage maps its two joints differently; ros2_control sorts them by name and may
    silently swap them.
    """
    # ros2_control requires a role everywhere; ROS 1 only for two joints.
    for found in transmissions(subject):
        pairs = SIZES.get(found.type) == 2
        for tag, elements in (("joint", found.joints), ("actuator", found.actuators)):
            roles = [role(element) for element in elements]
            how = "<role>{}1</role>" if found.ros1 else 'role="{}1"'
            if pairs and len(elements) == 2 and sorted(roles) != [f"{tag}1", f"{tag}2"]:
                shown = " and ".join(f"'{word}'" if word else "none" for word in roles)
                expected = f"{tag}1 and {tag}2"
                message = f"transmission '{found.name}': roles of its {tag}s are {shown}; expected {expected}"
                yield Diagnostic("URDF312", message, elements[0].place, how.format(tag))
            elif not pairs and not found.ros1 and "" in roles:
                message = f"transmission '{found.name}': {'an' if tag == 'actuator' else 'a'} {tag} has no role"
                yield Diagnostic("URDF312", message, elements[roles.index("")].place, how.format(tag))
            names = [element.name for element in elements]
            if pairs and len(names) == 2 and names[0] and names[0] == names[1]:
                message = f"transmission '{found.name}': {tag} '{names[0]}' has both roles; expected 2 {tag}s"
                yield Diagnostic("URDF312", message, elements[1].place, None)


@check(
    "URDF313",
    "transmission-count",
    "readiness",
    bad=one_joint(more=transmission(GEARED + MOTOR + MOTOR.replace('"m"', '"n"'))),
)
def _count(subject: Subject) -> Iterator[Diagnostic]:
    """A transmission has the wrong number of joints or actuators for its type.

    A simple transmission has one of each, a differential and a four-bar linkage two; ros_control rejects other
    numbers.
    """
    # In ros2_control the actuator of a simple transmission is optional.
    for found in transmissions(subject):
        count = SIZES.get(found.type)
        joints, actuators = len(found.joints), len(found.actuators)
        if count is None or joints == 0 or (joints == actuators == count):
            continue
        if not found.ros1 and joints == count == 1 and actuators == 0:
            continue
        message = f"transmission '{found.name}' has {joints} joints and {actuators} actuators; expected {count} each"
        yield Diagnostic("URDF313", message, found.element.place, None)


@check(
    "URDF314",
    "hardware-interface",
    "readiness",
    "warning",
    bad=one_joint(more=transmission('<joint name="j"/>' + MOTOR)),
)
def _hardware_interface(subject: Subject) -> Iterator[Diagnostic]:
    """A joint of a ROS 1 transmission has no hardware interface, or an unknown one.

    ros_control then silently skips the joint; no controller finds it.
    """
    # The prefix `hardware_interface/` is optional: old descriptions have none.
    for found in transmissions(subject):
        for joint in found.joints if found.ros1 else ():
            name = joint.attributes.get("name", "")
            interfaces = joint.all("hardwareInterface")
            if not interfaces:
                message = f"transmission '{found.name}': joint '{name}' has no <hardwareInterface>"
                hint = f"<hardwareInterface>hardware_interface/{_likely_interface(found)}</hardwareInterface>"
                yield Diagnostic("URDF314", message, joint.place, hint, "warning")
            for interface in interfaces:
                word = interface.text.strip()
                if word.rpartition("/")[2] not in INTERFACES:
                    message = f"transmission '{found.name}': unknown hardware interface '{word}' of joint '{name}'"
                    near = did_you_mean(word.rpartition("/")[2], list(INTERFACES))
                    yield Diagnostic("URDF314", message, interface.place, near, "warning")


def _likely_interface(found: WrittenTransmission) -> str:
    """The interface at an actuator, where old descriptions have it; else position."""
    tags = (tag for actuator in found.actuators for tag in actuator.all("hardwareInterface"))
    words = (tag.text.strip().rpartition("/")[2] for tag in tags)
    return next((word for word in words if word in INTERFACES), "PositionJointInterface")


@check("URDF315", "transmission-joint", "readiness", bad=one_joint(kind="fixed", inside="", more=transmission()))
def _joint(subject: Subject) -> Iterator[Diagnostic]:
    """A transmission drives a fixed joint or a mimic joint.

    A fixed joint does not move, and a mimic joint has no actuator: the joint it follows determines its position.
    """
    joints = {joint.name: joint for joint in subject.parts.joints}
    for found in transmissions(subject):
        for element in found.joints:
            joint = joints.get(element.name)
            if joint is None or joint.independent:
                continue
            severity: Severity = "warning" if joint.moves else "error"
            what = f"mimics '{joint.mimic.joint}'" if joint.mimic is not None else "is fixed"
            message = f"transmission '{found.name}' drives joint '{joint.name}', which {what}"
            yield Diagnostic("URDF315", message, element.place, "remove the transmission", severity)


@check(
    "URDF316",
    "transmission-reduction",
    "readiness",
    "warning",
    bad=one_joint(more=transmission(GEARED + '<actuator name="m"/>')),
)
def _reduction(subject: Subject) -> Iterator[Diagnostic]:
    """A ROS 1 transmission has no reduction at its actuator.

    ros_control does not load a transmission without <mechanicalReduction> there; manipcli uses 1.
    """
    for found in transmissions(subject):
        for actuator in found.actuators if found.ros1 else ():
            if actuator.first("mechanicalReduction") is None:
                name = actuator.attributes.get("name", "")
                message = f"transmission '{found.name}': actuator '{name}' has no <mechanicalReduction>"
                yield Diagnostic(
                    "URDF316", message, actuator.place, "<mechanicalReduction>1</mechanicalReduction>", "warning"
                )


@check("URDF317", "transmission-name", "readiness", bad=one_joint(more=transmission().replace(' name="t"', "")))
def _name(subject: Subject) -> Iterator[Diagnostic]:
    """A transmission has no name or a duplicate name.

    ros_control and ros2_control look up transmissions by name and do not load such a transmission.
    """
    seen: set[tuple[bool, str]] = set()
    for found in transmissions(subject):
        name = found.element.name
        if not name:
            yield Diagnostic("URDF317", f"a {found.type} has no name", found.element.place, 'name="..."')
        elif (found.ros1, name) in seen:
            yield Diagnostic("URDF317", f"duplicate transmission '{name}'", found.element.place, None)
        seen.add((found.ros1, name))


@check("URDF318", "transmission-unread", "readiness", "warning", bad=one_joint(more=transmission(_UNREAD + MOTOR)))
def _unread(subject: Subject) -> Iterator[Diagnostic]:
    """The reduction of a simple transmission is at the wrong element.

    ros_control reads the reduction of the actuator, ros2_control that of the joint; each silently ignores the other,
    and so does manipcli.
    """
    for found in transmissions(subject):
        if found.type != "SimpleTransmission":
            continue
        read = "actuator" if found.ros1 else "joint"
        for element in found.joints if found.ros1 else found.actuators:
            child = element.first("mechanicalReduction") or element.first("mechanical_reduction")
            if child is None or finite(child.text) in (None, 1.0):
                continue
            message = f"transmission '{found.name}': reduction {child.text} of its {element.tag} is ignored"
            yield Diagnostic("URDF318", message, child.place, f"move it to the {read}", "warning")
