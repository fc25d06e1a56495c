"""Elements that <ros2_control> does not have."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.located_xml import Element
from manipcli.model.samples import one_joint

KNOWN: Final = ("hardware", "joint", "sensor", "gpio", "transmission")


def _find(subject: Subject) -> Iterator[Finding]:
    for component in subject.description.root.all("ros2_control"):
        name = component.attributes.get("name", "")
        seen: set[str] = set()
        for child in component.children:
            if child.tag not in KNOWN:
                message = f"ros2_control '{name}' has an element <{child.tag}>; expected {', '.join(KNOWN)}"
                yield Finding("URDF325", message, child.place, None)
            joint = child.attributes.get("name", "").strip()
            if child.tag == "joint" and joint in seen:
                yield Finding("URDF325", f"ros2_control '{name}' has joint '{joint}' twice", child.place, None)
            seen |= {joint} if child.tag == "joint" else set()
        if component.attributes.get("type", "").strip() == "actuator" and len(component.all("joint")) > 1:
            message = f"ros2_control '{name}' is an actuator and has {len(component.all('joint'))} joints; expected one"
            yield Finding("URDF325", message, component.all("joint")[1].place, 'type="system" may have several')
        for parameter in _parameters(component):
            if not parameter.attributes.get("name", "").strip():
                yield Finding("URDF325", f"ros2_control '{name}': a <param> has no name", parameter.place, None)


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
    summary="A <ros2_control> has an element, joint or parameter that may not be there as it is",
    reason=(
        "Its parser knows hardware, joint, sensor, gpio and transmission, and throws at any other; a joint "
        "stands there once, an actuator has one, and a parameter has a name."
    ),
    bad=one_joint(
        more='<ros2_control name="c" type="system"><hardware><plugin>p/P</plugin></hardware>'
        '<joint name="j"/><joint name="j"/></ros2_control>'
    ),
    find=_find,
)
