"""Checks of numbers and booleans in <ros2_control>."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.core.text import shorten
from manipcli.description.elements import JointLimits
from manipcli.description.lint.check import Subject, check
from manipcli.description.lint.control_tags import controlled_joints
from manipcli.description.lint.samples import controlled, one_joint
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import finite

BOOLEANS: Final = ("true", "false", "True", "False")
TYPES: Final = ("double", "float32", "bool", "int8", "int16", "int32", "uint8", "uint16", "uint32")


@check(
    "URDF324",
    "control-number",
    "readiness",
    bad=one_joint(
        more=controlled(
            '<joint name="j"><state_interface name="position"><param name="initial_value">half</param>'
            "</state_interface></joint>"
        )
    ),
)
def _find(subject: Subject) -> Iterator[Diagnostic]:
    """A number or boolean in <ros2_control> is invalid or contradicts the limits.

    ros2_control silently uses its default instead. An initial position outside the limits starts the robot in an
    impossible configuration.
    """
    for component in subject.description.root.all("ros2_control"):
        rate = component.attributes.get("rw_rate", "1").strip()
        if not _whole(rate):
            message = (
                f"ros2_control '{component.attributes.get('name', '')}': rw_rate is '{rate}'; expected a whole number"
            )
            yield Diagnostic("URDF324", message, component.place, None)
        yield from _boolean(component, "is_async")
    limits = {joint.name: joint.limits for joint in subject.parts.joints}
    for joint in controlled_joints(subject):
        for element in joint.element.all("limits"):
            yield from _boolean(element, "enable")
        yield from _legacy(joint.element)
        for interface in (*joint.commands, *joint.element.all("state_interface")):
            yield from _interface(f"joint '{joint.name}'", interface, limits.get(joint.name, JointLimits()))


def _interface(joint: str, interface: Element, limits: JointLimits) -> Iterator[Diagnostic]:
    kind = interface.attributes.get("data_type", "double").strip()
    if kind not in TYPES:
        message = f"{joint}: unknown data_type '{kind}' of an interface; known: {', '.join(TYPES)}"
        yield Diagnostic("URDF324", message, interface.place, None, "warning")
    for element in interface.all("limits"):
        yield from _boolean(element, "enable")
    size = interface.attributes.get("size", "1").strip()
    if not _whole(size):
        message = f"{joint}: interface size is '{size}'; expected a whole number"
        yield Diagnostic("URDF324", message, interface.place, None)
    values, wrong = _parameters(joint, interface)
    yield from wrong
    if "min" in values and "max" in values and values["min"] > values["max"]:
        message = f"{joint}: min {values['min']:g} is above max {values['max']:g}"
        yield Diagnostic("URDF324", message, interface.place, None)
    if interface.attributes.get("name") != "position":
        return
    lower, upper = limits.range
    for key, beyond in (("min", values.get("min", lower) > upper), ("max", values.get("max", upper) < lower)):
        if beyond and interface.tag == "command_interface":
            message = f"{joint}: {key} {values[key]:g} is outside its limits {lower:g} to {upper:g}"
            yield Diagnostic("URDF324", message, interface.place, "choose a value inside <limit>, in rad or m")
    start = values.get("initial_value")
    if start is None:
        return
    if not lower - 1e-9 <= start <= upper + 1e-9:
        message = f"{joint}: initial position {start:g} is outside its limits"
        hint = f"limits: {lower:g} to {upper:g}" if None not in (limits.lower, limits.upper) else None
        yield Diagnostic("URDF324", message, interface.place, hint, "warning")


def _parameters(joint: str, interface: Element) -> tuple[dict[str, float], list[Diagnostic]]:
    """The valid numbers of an interface, and findings about the others."""
    values: dict[str, float] = {}
    wrong = []
    for parameter in interface.all("param"):
        key, text = parameter.attributes.get("name", ""), parameter.text.strip()
        value = finite(text)
        if key not in ("min", "max", "initial_value"):
            continue
        if value is not None:
            values[key] = value
        elif text:
            message = f"{joint}: {key} is '{shorten(text)}'; expected a finite number"
            wrong.append(Diagnostic("URDF324", message, parameter.place, None))
        elif key != "initial_value":  # an empty initial_value is common and has no effect
            message = f'{joint}: <param name="{key}"> is empty; expected a number'
            wrong.append(Diagnostic("URDF324", message, parameter.place, "give a value, or delete the <param>"))
    return values, wrong


def _boolean(element: Element, attribute: str) -> Iterator[Diagnostic]:
    text = element.attributes.get(attribute, "true").strip()
    if text not in BOOLEANS:
        message = f"<{element.tag}>: {attribute} is '{shorten(text)}'; expected true or false"
        yield Diagnostic("URDF324", message, element.place, None)


def _legacy(joint: Element) -> Iterator[Diagnostic]:
    """<param name="multiplier"> and "offset" of a joint with <param name="mimic">."""
    for parameter in joint.all("param"):
        key, text = parameter.name, parameter.text.strip()
        if key in ("multiplier", "offset") and finite(text) is None:
            message = f"joint '{joint.name}': {key} is '{shorten(text)}'; expected a finite number"
            yield Diagnostic("URDF324", message, parameter.place, None)


def _whole(text: str) -> bool:
    """Whether a text is a positive integer in ASCII digits."""
    return text.isascii() and text.isdigit() and int(text) > 0
