"""Elements that <ros2_control> does not have, and such that it has once."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.core.text import did_you_mean
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import ControlledJoint, controlled_joints
from manipcli.model.located_xml import Element
from manipcli.model.samples import one_joint

KNOWN: Final = ("hardware", "joint", "sensor", "gpio", "transmission")
PARTS: Final = ("command_interface", "state_interface", "param", "limits")
"""Of a joint, a sensor or a gpio."""


def _find(subject: Subject) -> Iterator[Finding]:
    names: set[str] = set()
    for component in subject.description.root.all("ros2_control"):
        name = component.attributes.get("name", "")
        if name.strip() and name.strip() in names:
            yield Finding("URDF325", f"ros2_control '{name}' is there twice", component.place, "name them apart")
        names.add(name.strip())
        seen: set[str] = set()
        for child in component.children:
            if child.tag not in KNOWN:
                message = f"ros2_control '{name}' has an element <{child.tag}>; expected {', '.join(KNOWN)}"
                yield Finding("URDF325", message, child.place, None)
            own = child.attributes.get("name", "").strip()
            if child.tag == "joint" and own in seen:
                yield Finding("URDF325", f"ros2_control '{name}' has joint '{own}' twice", child.place, None)
            if child.tag in ("sensor", "gpio") and not own:
                yield Finding(
                    "URDF325", f"ros2_control '{name}': a <{child.tag}> has no name", child.place, 'name="..."'
                )
            seen |= {own} if child.tag == "joint" else set()
            yield from _within(child, name)
        if component.attributes.get("type", "").strip() == "actuator" and len(component.all("joint")) > 1:
            message = f"ros2_control '{name}' is an actuator and has {len(component.all('joint'))} joints; expected one"
            yield Finding("URDF325", message, component.all("joint")[1].place, 'type="system" may have several')
        for parameter in _parameters(component):
            if not parameter.attributes.get("name", "").strip():
                yield Finding("URDF325", f"ros2_control '{name}': a <param> has no name", parameter.place, None)
    yield from _commanded_twice(subject)


def _within(element: Element, component: str) -> Iterator[Finding]:
    """What a joint, a sensor or a gpio holds: elements that nobody reads, and interfaces that are there twice."""
    if element.tag not in ("joint", "sensor", "gpio"):
        return
    what = f"ros2_control '{component}': {element.tag} '{element.attributes.get('name', '')}'"
    seen: set[tuple[str, str]] = set()
    for child in element.children:
        if child.tag not in PARTS and ":" not in child.tag:
            message = f"{what} has an element <{child.tag}>, which is ignored"
            yield Finding("URDF325", message, child.place, did_you_mean(child.tag, PARTS, kind="known"), "warning")
        interface = child.tag, child.attributes.get("name", "").strip()
        if child.tag.endswith("_interface") and interface[1] and interface in seen:
            yield Finding("URDF325", f"{what} has <{child.tag}> '{interface[1]}' twice", child.place, None)
        seen.add(interface)


def _commanded_twice(subject: Subject) -> Iterator[Finding]:
    """Command interfaces of one joint in two components, and any in one that is a sensor."""
    sensors = {
        component.attributes.get("name", "")
        for component in subject.description.root.all("ros2_control")
        if component.attributes.get("type", "").strip() == "sensor"
    }
    owners: dict[tuple[str, str], ControlledJoint] = {}
    for joint in controlled_joints(subject):
        for interface in joint.commands:
            name = interface.attributes.get("name", "").strip()
            what = f"ros2_control '{joint.component}': command interface '{name}' of joint '{joint.name}'"
            if joint.component in sensors:
                hint = 'a sensor has state interfaces only; type="system" may have both'
                yield Finding("URDF325", f"{what}, but it is a sensor", interface.place, hint)
            owner = owners.setdefault((joint.name, name), joint)
            if name and owner.component != joint.component:
                message = f"{what} belongs to ros2_control '{owner.component}' already"
                yield Finding("URDF325", message, interface.place, "one hardware commands a joint")


def _parameters(element: Element) -> Iterator[Element]:
    for child in element.children:
        if child.tag == "param":
            yield child
        yield from _parameters(child)


CHECK = Check(
    code="URDF325",
    name="control-element",
    tier="readiness",
    severity="error",
    summary="A <ros2_control> has an element, joint, interface or parameter that may not be there as it is",
    reason=(
        "Its parser knows hardware, joint, sensor, gpio and transmission, and throws at any other; what it does not "
        "know below a joint it leaves out. A joint and an interface stand there once, an actuator has one joint, a "
        "sensor commands nothing, and a parameter has a name."
    ),
    bad=one_joint(
        more='<ros2_control name="c" type="system"><hardware><plugin>p/P</plugin></hardware>'
        '<joint name="j"/><joint name="j"/></ros2_control>'
    ),
    find=_find,
)
