"""Transmissions that ros_control or ros2_control would not load, or would load as something else."""

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
    """A transmission is of a type that is not known.

    It is left out: commands go to the joint as if there were no gear.
    """
    for found in transmissions(subject):
        if found.type not in SIZES:
            kind = found.element.first("type") or found.element.first("plugin") or found.element
            message = f"transmission '{found.name}' is of the unknown type '{found.type}'"
            hint = did_you_mean(found.type, list(SIZES)) or "known: " + ", ".join(SIZES)
            yield Diagnostic("URDF310", message, kind.place, hint, "warning")


@check(
    "URDF311",
    "transmission-shared",
    "readiness",
    bad=one_joint(more=transmission() + transmission().replace('"t"', '"u"')),
)
def _shared(subject: Subject) -> Iterator[Diagnostic]:
    """A joint or actuator belongs to two transmissions, or to two unlike ones of ROS 1 and ros2_control.

    Each of them would set its position; which one wins depends on the order of loading.
    """
    # ROS 1 and ros2_control may describe the same gear, each in its own place: they are two lists. Two joints with an
    # actuator of one name are two motors with a name copied, which does no harm in joint space.
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
                message = f"transmission '{found.name}': {tag} '{name}' belongs to transmission '{owner.name}' already"
                yield Diagnostic("URDF311", message, element.place, f"each {tag} has one transmission", severity)
    yield from _unlike(subject)


def _unlike(subject: Subject) -> Iterator[Diagnostic]:
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
                yield Diagnostic("URDF311", message, found.element.place, "make them alike, or take one out", "warning")
                break


def _gear(tag: TransmissionTag) -> tuple[object, ...]:
    """All but its names."""
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
    """A transmission does not say by roles which joint and actuator is which.

    A differential or a four-bar linkage maps its two joints in different ways; ros2_control sorts them by name and
    swaps them without a word.
    """
    # ros2_control wants a role everywhere; ROS 1 only where there are two.
    for found in transmissions(subject):
        pairs = SIZES.get(found.type) == 2
        for tag, elements in (("joint", found.joints), ("actuator", found.actuators)):
            roles = [role(element) for element in elements]
            how = "<role>{}1</role>" if found.ros1 else 'role="{}1"'
            if pairs and len(elements) == 2 and sorted(roles) != [f"{tag}1", f"{tag}2"]:
                shown = " and ".join(f"'{each}'" if each else "none" for each in roles)
                expected = f"{tag}1 and {tag}2"
                message = f"transmission '{found.name}': its {tag}s have the roles {shown}; expected {expected}"
                yield Diagnostic("URDF312", message, elements[0].place, how.format(tag))
            elif not pairs and not found.ros1 and "" in roles:
                message = f"transmission '{found.name}': {'an' if tag == 'actuator' else 'a'} {tag} has no role"
                yield Diagnostic("URDF312", message, elements[roles.index("")].place, how.format(tag))
            names = [element.name for element in elements]
            if pairs and len(names) == 2 and names[0] and names[0] == names[1]:
                message = f"transmission '{found.name}': {tag} '{names[0]}' has both roles; expected two {tag}s"
                yield Diagnostic("URDF312", message, elements[1].place, None)


@check(
    "URDF313",
    "transmission-count",
    "readiness",
    bad=one_joint(more=transmission(GEARED + MOTOR + MOTOR.replace('"m"', '"n"'))),
)
def _count(subject: Subject) -> Iterator[Diagnostic]:
    """A transmission does not have as many joints and actuators as its type takes.

    A simple one has one of each, a differential and a four-bar linkage two; ros_control does not load another.
    """
    # In ros2_control the actuator may be left out of a simple one.
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

    ros_control then leaves the joint out without an error; no controller finds it.
    """
    # The name may carry the prefix `hardware_interface/`; without it, it is old but read.
    for found in transmissions(subject):
        for joint in found.joints if found.ros1 else ():
            name = joint.attributes.get("name", "")
            interfaces = joint.all("hardwareInterface")
            if not interfaces:
                message = f"transmission '{found.name}': joint '{name}' has no <hardwareInterface>"
                hint = f"<hardwareInterface>hardware_interface/{_meant(found)}</hardwareInterface>"
                yield Diagnostic("URDF314", message, joint.place, hint, "warning")
            for interface in interfaces:
                word = interface.text.strip()
                if word.rpartition("/")[2] not in INTERFACES:
                    message = f"transmission '{found.name}': joint '{name}' has the unknown hardware interface '{word}'"
                    near = did_you_mean(word.rpartition("/")[2], list(INTERFACES))
                    yield Diagnostic("URDF314", message, interface.place, near, "warning")


def _meant(found: WrittenTransmission) -> str:
    """What an actuator of it says, as old descriptions do; else position."""
    said = (word.text.strip().rpartition("/")[2] for one in found.actuators for word in one.all("hardwareInterface"))
    return next((word for word in said if word in INTERFACES), "PositionJointInterface")


@check("URDF315", "transmission-joint", "readiness", bad=one_joint(kind="fixed", inside="", more=transmission()))
def _joint(subject: Subject) -> Iterator[Diagnostic]:
    """A transmission drives a fixed joint or one that follows another.

    A fixed joint does not move, and a mimic joint has no actuator of its own: its position is that of the joint it
    follows.
    """
    joints = {joint.name: joint for joint in subject.parts.joints}
    for found in transmissions(subject):
        for element in found.joints:
            joint = joints.get(element.name)
            if joint is None or joint.independent:
                continue
            severity: Severity = "warning" if joint.moves else "error"
            what = f"follows '{joint.mimic.joint}' (mimic)" if joint.mimic is not None else "is fixed"
            message = f"transmission '{found.name}' drives joint '{joint.name}', which {what}"
            yield Diagnostic("URDF315", message, element.place, "take the transmission out", severity)


@check(
    "URDF316",
    "transmission-reduction",
    "readiness",
    "warning",
    bad=one_joint(more=transmission(GEARED + '<actuator name="m"/>')),
)
def _reduction(subject: Subject) -> Iterator[Diagnostic]:
    """A ROS 1 transmission states no reduction at its actuator.

    ros_control wants <mechanicalReduction> there and does not load the transmission without it; here it counts as
    1.
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
    """A transmission has no name, or one that another has.

    ros_control and ros2_control find transmissions by name, and load no other.
    """
    seen: set[tuple[bool, str]] = set()
    for found in transmissions(subject):
        name = found.element.name
        if not name:
            yield Diagnostic("URDF317", f"a {found.type} has no name", found.element.place, 'name="..."')
        elif (found.ros1, name) in seen:
            yield Diagnostic("URDF317", f"transmission '{name}' is written twice", found.element.place, None)
        seen.add((found.ros1, name))


@check("URDF318", "transmission-unread", "readiness", "warning", bad=one_joint(more=transmission(_UNREAD + MOTOR)))
def _unread(subject: Subject) -> Iterator[Diagnostic]:
    """A simple transmission states a reduction where nobody reads it.

    ros_control reads the reduction of the actuator, ros2_control that of the joint; each leaves the other out
    without a word, and so is done here.
    """
    for found in transmissions(subject):
        if found.type != "SimpleTransmission":
            continue
        read = "actuator" if found.ros1 else "joint"
        for element in found.joints if found.ros1 else found.actuators:
            child = element.first("mechanicalReduction") or element.first("mechanical_reduction")
            if child is None or finite(child.text) in (None, 1.0):
                continue
            message = f"transmission '{found.name}': the reduction {child.text} of its {element.tag} is not read"
            yield Diagnostic("URDF318", message, child.place, f"write it at the {read}", "warning")
