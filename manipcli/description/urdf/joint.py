"""Reader of <joint> and <transmission> elements."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Collection
from typing import Final, Literal

import numpy as np

from manipcli.core.geometry import Array, frozen
from manipcli.core.text import shorten
from manipcli.description.elements import Joint, JointLimits, JointType, Mimic, SoftLimits, TransmissionTag
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import FARTHEST, LARGEST, Reader
from manipcli.spec.robot import UNIT_TOLERANCE

_TYPES: dict[str, JointType] = {
    "revolute": "revolute",
    "continuous": "continuous",
    "prismatic": "prismatic",
    "fixed": "fixed",
    "floating": "fixed",
    "planar": "fixed",
}
_HELD = frozenset({"floating", "planar"})
"""Types with several degrees of freedom, which are treated as fixed."""
UNSTATED: Final = "URDF036"
"""Code of a limit that is 0 or missing, read as not stated."""
UNBOUNDED: Final = sys.float_info.max
"""Written as the limit of an unlimited joint where URDF requires one."""


def read_joint(reader: Reader, element: Element, name: str) -> Joint | None:
    """The joint of a <joint> element; None, with findings, if its parent or child is missing.

    Links and mimic joint are resolved later.
    """
    text = element.attributes.get("type")
    kind = _TYPES.get(text or "")
    if kind is None:
        what = f"the unknown type '{shorten(text)}'" if text else "no attribute 'type'"
        reader.report("URDF008", f"joint '{name}' has {what}", element.place, hint=reader.near(text or "", _TYPES))
    if text in _HELD:
        message = f"joint '{name}' is {text}, which is not supported: it is treated as fixed"
        hint = "use joints with one degree of freedom, or place the robot with `mount:` in the robot file"
        reader.report("URDF065", message, element.place, hint=hint, severity="warning")
    ends = [_end(reader, element, name, tag) for tag in ("parent", "child")]
    X_PJ = reader.origin(element)
    dynamics = element.first("dynamics")
    damping = friction = 0.0
    if dynamics is not None:
        damping, friction = (
            _not_negative(reader, dynamics, key, name, most=LARGEST) or 0.0 for key in ("damping", "friction")
        )
    if ends[0] is None or ends[1] is None:
        return None
    moves = kind != "fixed"
    # Errors are reported; placeholder values allow the rest of the description to be checked.
    return Joint(
        name=name,
        type=kind or "continuous",
        parent=ends[0],
        child=ends[1],
        X_PJ=X_PJ,
        axis=_axis(reader, element, name) if moves else frozen([1.0, 0.0, 0.0]),
        limits=_with_soft(reader, element, name, kind) if moves and kind is not None else JointLimits(),
        mimic=_mimic(reader, element) if moves else None,
        damping=damping if moves else 0.0,
        friction=friction if moves else 0.0,
    )


def _end(reader: Reader, element: Element, name: str, tag: Literal["parent", "child"]) -> str | None:
    end = element.first(tag)
    if end is None:
        reader.report("URDF060", f"joint '{name}' has no <{tag} link=\"...\"/>", element.place)
        return None
    return reader.name(end, "link")


def _axis(reader: Reader, element: Element, name: str) -> Array:
    """Unit axis (3,); x if it is missing or invalid."""
    axis = element.first("axis")
    if axis is None or "xyz" not in axis.attributes:
        return frozen([1.0, 0.0, 0.0])
    values = reader.numbers(axis, "xyz", 3)
    if values is None:
        return frozen([1.0, 0.0, 0.0])
    length = math.hypot(*values)
    if not 1e-9 < length < 1e9:
        what = "the axis 0 0 0" if length < 1e-9 else f"an axis of length {length:g}"
        reader.report("URDF009", f"joint '{name}' has {what}; expected a direction", axis.place)
        return frozen([1.0, 0.0, 0.0])
    if abs(length - 1.0) > UNIT_TOLERANCE:
        message = f"joint '{name}': axis has length {length:g}; it is normalised"
        reader.report("URDF034", message, axis.place, severity="warning")
    unit = np.array(values)
    # An axis of unit length within rounding is kept, so that reading a written file changes nothing.
    return frozen(unit if abs(length - 1.0) < 1e-15 else unit / length)


def _not_negative(
    reader: Reader, element: Element, attribute: str, joint: str, *, most: float = math.inf
) -> float | None:
    value = reader.number(element, attribute, most=most)
    if value is not None and value < 0.0:
        message = f"joint '{joint}': {attribute} is {value:g}; expected 0 or more"
        reader.report("URDF010", message, element.place)
        return None
    return value


def _with_soft(reader: Reader, element: Element, name: str, kind: JointType) -> JointLimits:
    """The limits with the soft limits of a <safety_controller>; equal soft positions have no effect."""
    limits = _limits(reader, element, name, kind)
    safety = element.first("safety_controller")
    if safety is None:
        return limits
    lower, upper = (reader.number(safety, f"soft_{side}_limit", 0.0) or 0.0 for side in ("lower", "upper"))
    k_position, k_velocity = (_not_negative(reader, safety, key, name) or 0.0 for key in ("k_position", "k_velocity"))
    positions = k_position > 0.0 and lower < upper and kind != "continuous"
    if not positions and lower < upper and kind != "continuous":
        message = f"joint '{name}': the soft limits {lower:g} to {upper:g} have no effect without k_position"
        hint = "add k_position, a velocity per distance [1/s]; 20 is a usual value"
        reader.report("URDF086", message, safety.place, hint=hint, severity="warning")
    if not positions and k_velocity == 0.0:
        return limits
    soft = SoftLimits(
        lower=lower if positions else None,
        upper=upper if positions else None,
        k_position=k_position if positions else 0.0,
        k_velocity=k_velocity,
    )
    return dataclasses.replace(limits, soft=soft)


def _limits(reader: Reader, element: Element, name: str, kind: JointType) -> JointLimits:
    limit = element.first("limit")
    if limit is None:
        if kind == "continuous":
            return JointLimits()
        hint = '<limit lower="..." upper="..." velocity="..." effort="..."/>'
        reader.report("URDF010", f"joint '{name}' is {kind} and has no <limit>", element.place, hint=hint)
        return JointLimits()
    lower, upper = (reader.number(limit, side) if side in limit.attributes else 0.0 for side in ("lower", "upper"))
    for side, other in (("lower", "upper"), ("upper", "lower")):
        if kind != "continuous" and side not in limit.attributes and other in limit.attributes:
            message = f"joint '{name}': {side} limit is missing; 0 is used"
            hint = f'write {side}="0" if this is intended'
            reader.report(UNSTATED, message, limit.place, hint=hint, severity="note")
    velocity, effort = (_stated(reader, limit, attribute, name) for attribute in ("velocity", "effort"))
    if kind == "continuous" or lower is None or upper is None or (lower == -UNBOUNDED and upper == UNBOUNDED):
        return JointLimits(velocity=velocity, effort=effort)
    if lower > upper:
        message = f"joint '{name}': lower limit {lower:g} is above upper limit {upper:g}"
        reader.report("URDF010", message, limit.place)
        return JointLimits(velocity=velocity, effort=effort)
    if lower == upper:
        message = f"joint '{name}' cannot move: lower and upper limit are both {lower:g}"
        reader.report("URDF035", message, limit.place, severity="warning")
    return JointLimits(lower=lower, upper=upper, velocity=velocity, effort=effort)


def _stated(reader: Reader, limit: Element, attribute: str, joint: str) -> float | None:
    """A velocity or effort limit; None if it is 0 or missing."""
    value = _not_negative(reader, limit, attribute, joint)
    if value:
        return value
    if value == 0.0 or attribute not in limit.attributes:
        how = "is 0" if value == 0.0 else "is missing"
        message = f"joint '{joint}': {attribute} limit {how}; it is read as not stated"
        hint = f"add it to the robot file: limits: {{{joint}: {{{attribute}: ...}}}}"
        reader.report(UNSTATED, message, limit.place, hint=hint, severity="warning")
    return None


def _mimic(reader: Reader, element: Element) -> Mimic | None:
    mimic = element.first("mimic")
    if mimic is None:
        return None
    joint = reader.name(mimic, "joint")
    multiplier = reader.number(mimic, "multiplier", 1.0, most=FARTHEST)
    offset = reader.number(mimic, "offset", 0.0, most=FARTHEST)
    if joint is None or multiplier is None or offset is None:
        return None
    return Mimic(joint=joint, multiplier=multiplier, offset=offset)


def read_transmissions(reader: Reader, root: Element, joints: Collection[str]) -> tuple[TransmissionTag, ...]:
    """Every <transmission>, of ROS 1 (below <robot>) and of ros2_control (below <ros2_control>)."""
    elements = [*root.all("transmission")]
    for control in root.all("ros2_control"):
        elements += control.all("transmission")
    found = (_transmission(reader, element, joints) for element in elements)
    return tuple(tag for tag in found if tag is not None)


def _transmission(reader: Reader, element: Element, joints: Collection[str]) -> TransmissionTag | None:
    name = element.name or "(without a name)"
    kind = element.first("type") or element.first("plugin")
    if kind is None and element.attributes.get("type"):
        message = f"transmission '{name}' has its type as an attribute, as before ros_control: ignored"
        hint = f"write <type>transmission_interface/{element.attributes['type'].rpartition('/')[2]}</type> inside"
        reader.report("URDF015", message, element.place, hint=hint, severity="warning")
        return None
    if kind is None or not kind.text:
        message = f"transmission '{name}' has no <type> (ROS 1) or <plugin> (ros2_control)"
        reader.report("URDF015", message, element.place)
        return None
    joint_elements = _by_role(element.all("joint"))
    actuator_elements = _by_role(element.all("actuator"))
    joint_names = [reader.name(joint) for joint in joint_elements]
    actuator_names = [reader.name(actuator) for actuator in actuator_elements]
    for joint, joint_name in zip(joint_elements, joint_names, strict=True):
        if joint_name is not None and joint_name not in joints:
            message = f"transmission '{name}' names joint '{joint_name}', which is not in the description"
            reader.report("URDF015", message, joint.place, hint=reader.near(joint_name, joints))
    if not joint_elements:
        reader.report("URDF015", f"transmission '{name}' has no <joint>", element.place)
    joint_reductions = [_reduction(reader, joint, name) for joint in joint_elements]
    actuator_reductions = [_reduction(reader, actuator, name) for actuator in actuator_elements]
    kind_name = kind.text.strip().rpartition("/")[2]
    if kind_name == "SimpleTransmission" and len(joint_elements) == 1 and len(actuator_elements) <= 1:
        ros1 = kind.tag == "type"  # ros_control reads the reduction of the actuator, ros2_control that of the joint
        actuator_names = actuator_names or [name]
        actuator_reductions = (actuator_reductions or [1.0]) if ros1 else joint_reductions
        joint_reductions = [1.0]
    return TransmissionTag(
        name=name,
        type=kind_name,
        joints=tuple(joint or "" for joint in joint_names),
        joint_reductions=tuple(joint_reductions),
        joint_offsets=tuple(reader.text_number(joint.first("offset"), 0.0) for joint in joint_elements),
        actuators=tuple(actuator or "" for actuator in actuator_names),
        actuator_reductions=tuple(actuator_reductions),
    )


def _by_role(elements: tuple[Element, ...]) -> list[Element]:
    """In the order of their roles (joint1, joint2, ...); without roles in the order of the file."""
    return sorted(elements, key=role)


def role(element: Element) -> str:
    """The role from a child element (ROS 1) or an attribute (ros2_control); '' if missing."""
    child = element.first("role")
    return (child.text if child is not None else element.attributes.get("role", "")).strip()


def _reduction(reader: Reader, element: Element, transmission: str) -> float:
    child = element.first("mechanicalReduction") or element.first("mechanical_reduction")
    # Published files of ROS 1 have words there; what has digits or is of ros2_control was meant as a number.
    words = child is not None and child.tag == "mechanicalReduction" and not any(map(str.isdigit, child.text))
    value = reader.text_number(child, 1.0, severity="warning" if words else "error")
    if value == 0.0:
        message = f"transmission '{transmission}': reduction is 0; expected a number other than 0"
        reader.report("URDF015", message, (child or element).place)
        return 1.0
    return value
