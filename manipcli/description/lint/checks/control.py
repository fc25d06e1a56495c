"""Checks of <ros2_control> components that the controller manager would reject."""

from collections.abc import Iterator
from difflib import get_close_matches
from typing import Final

from manipcli.core.errors import Diagnostic
from manipcli.core.text import did_you_mean
from manipcli.description.lint.check import Subject, check
from manipcli.description.lint.control_tags import ControlledJoint, controlled_joints
from manipcli.description.lint.rigid import elements_by_name
from manipcli.description.lint.samples import another, controlled, one_joint
from manipcli.description.located_xml import Element

TYPES: Final = ("system", "actuator", "sensor")
INTERFACES: Final = ("position", "velocity", "effort", "acceleration", "torque", "force", "current", "temperature")
OTHER_INTERFACES: Final = (
    "absolute_position",
    "feedforward",
    "proportional",
    "integral",
    "derivative",
    "integral_clamp_max",
)
ELEMENTS: Final = ("hardware", "joint", "sensor", "gpio", "transmission")
PARTS: Final = ("command_interface", "state_interface", "param", "limits")
"""Child elements of a joint, a sensor or a gpio."""


@check(
    "URDF320",
    "control-joint",
    "readiness",
    bad=one_joint(more=controlled('<joint name="k"><command_interface name="position"/></joint>')),
)
def _joint(subject: Subject) -> Iterator[Diagnostic]:
    """A <ros2_control> names an unknown or fixed joint, or its transmission names a joint it does not contain.

    The controller manager rejects the whole description at start-up.
    """
    written = elements_by_name(subject.description.root, "joint")
    for joint in controlled_joints(subject):
        if joint.name not in written:
            message = f"ros2_control '{joint.component}': joint '{joint.name}' is not in the description"
            yield Diagnostic("URDF320", message, joint.element.place, did_you_mean(joint.name, list(written)))
        elif written[joint.name].attributes.get("type") == "fixed":
            message = f"ros2_control '{joint.component}': joint '{joint.name}' is fixed"
            yield Diagnostic("URDF320", message, joint.element.place, "remove it, or change the type of the joint")
    for component in subject.description.root.all("ros2_control"):
        own = [joint.name for joint in component.all("joint")]
        for transmission in component.all("transmission"):
            for element in transmission.all("joint"):
                name = element.name
                if name not in own:
                    what = f"ros2_control '{component.attributes.get('name', '')}': joint '{name}' of transmission "
                    message = f"{what}'{transmission.attributes.get('name', '')}' is not one of its joints"
                    yield Diagnostic("URDF320", message, element.place, did_you_mean(name, own))


@check(
    "URDF321",
    "control-mimic",
    "readiness",
    bad=one_joint(
        more=another('<mimic joint="j"/>') + controlled('<joint name="k"><command_interface name="position"/></joint>')
    ),
)
def _mimic(subject: Subject) -> Iterator[Diagnostic]:
    """A mimic joint has its own command interface, or no joint to follow.

    It would be a second command for one degree of freedom. ros2_control rejects it.
    """
    # `mimic="false"` at the joint of the component makes it independent there.
    written = elements_by_name(subject.description.root, "joint")
    together = [(joint.component, joint.name) for joint in controlled_joints(subject)]
    for joint in controlled_joints(subject):
        mimic = written[joint.name].first("mimic") if joint.name in written else None
        stated = joint.element.attributes.get("mimic", "").strip()
        what = f"ros2_control '{joint.component}': joint '{joint.name}'"
        if mimic is None and stated == "true" and joint.name in written:
            message = f'{what} has mimic="true", but its <joint> has no <mimic>'
            yield Diagnostic("URDF321", message, joint.element.place, None)
        if mimic is None or stated == "false":
            continue
        target = mimic.attributes.get("joint", "").strip()
        if joint.commands:
            message = f"{what} mimics '{target}' and has a command interface"
            yield Diagnostic("URDF321", message, joint.commands[0].place, "keep only its state interfaces")
        if target in written and (joint.component, target) not in together:
            message = f"{what} mimics '{target}', which is not in this ros2_control"
            yield Diagnostic("URDF321", message, joint.element.place, f"add '{target}' there, or remove '{joint.name}'")


@check(
    "URDF322",
    "control-plugin",
    "readiness",
    bad=one_joint(
        more='<ros2_control name="c" type="system"><joint name="j"><command_interface name="position"/></joint>'
        "</ros2_control>"
    ),
)
def _plugin(subject: Subject) -> Iterator[Diagnostic]:
    """A <ros2_control> has no plugin, no name, or an unknown type.

    The controller manager does not start with it.
    """
    for component in subject.description.root.all("ros2_control"):
        name = component.name
        hardware, plugin = component.first("hardware"), component.first("hardware", "plugin")
        if not name:
            yield Diagnostic("URDF322", "a <ros2_control> has no name", component.place, 'name="..."')
        if component.attributes.get("type", "").strip() not in TYPES:
            kind = component.attributes.get("type", "")
            message = f"ros2_control '{name}' has type '{kind}'; expected {', '.join(TYPES)}"
            yield Diagnostic("URDF322", message, component.place, 'type="system"')
        if plugin is None or not plugin.text.strip():
            message = f"ros2_control '{name}' has no <hardware> with a <plugin>"
            hint = "<hardware><plugin>mock_components/GenericSystem</plugin></hardware>"
            yield Diagnostic("URDF322", message, (hardware or component).place, hint)


@check(
    "URDF323",
    "control-interface",
    "readiness",
    "warning",
    bad=one_joint(more=controlled('<joint name="j"><command_interface name="postion"/></joint>')),
)
def _interface(subject: Subject) -> Iterator[Diagnostic]:
    """An interface of ros2_control has no name, or a name close to a standard one.

    Controllers claim interfaces by exact names such as position, velocity, effort or acceleration.
    """
    # A name far from all standard names is custom, which is allowed.
    for joint in controlled_joints(subject):
        for interface in (*joint.commands, *joint.element.all("state_interface")):
            name = interface.name
            near = get_close_matches(name, INTERFACES, n=1, cutoff=0.8) if name else ["position"]
            if name in INTERFACES or name in OTHER_INTERFACES or not near:
                continue
            what = f"the unknown name '{name}'" if name else "no name"
            message = f"ros2_control '{joint.component}': joint '{joint.name}' has an interface with {what}"
            yield Diagnostic("URDF323", message, interface.place, f"did you mean '{near[0]}'?", "warning")


@check("URDF325", "control-element", "readiness", bad=one_joint(more=controlled('<joint name="j"/><joint name="j"/>')))
def _element(subject: Subject) -> Iterator[Diagnostic]:
    """A <ros2_control> has an unknown, duplicate or unnamed element.

    Its parser accepts hardware, joint, sensor, gpio and transmission, throws on any other element, and ignores
    unknown elements below a joint. Joints and interfaces must be unique, an actuator has one joint, a sensor has no
    command interface, and a parameter needs a name.
    """
    names: set[str] = set()
    for component in subject.description.root.all("ros2_control"):
        name = component.attributes.get("name", "")
        if name.strip() and name.strip() in names:
            yield Diagnostic("URDF325", f"duplicate ros2_control '{name}'", component.place, "rename one of them")
        names.add(name.strip())
        seen: set[str] = set()
        for child in component.children:
            if child.tag not in ELEMENTS:
                message = f"ros2_control '{name}' has the unknown element <{child.tag}>; expected {', '.join(ELEMENTS)}"
                yield Diagnostic("URDF325", message, child.place, None)
            own = child.name
            if child.tag == "joint" and own in seen:
                yield Diagnostic("URDF325", f"ros2_control '{name}' has duplicate joint '{own}'", child.place, None)
            if child.tag in ("sensor", "gpio") and not own:
                yield Diagnostic(
                    "URDF325", f"ros2_control '{name}': a <{child.tag}> has no name", child.place, 'name="..."'
                )
            seen |= {own} if child.tag == "joint" else set()
            yield from _children(child, name)
        if component.attributes.get("type", "").strip() == "actuator" and len(component.all("joint")) > 1:
            message = f"ros2_control '{name}' is an actuator with {len(component.all('joint'))} joints; expected 1"
            yield Diagnostic("URDF325", message, component.all("joint")[1].place, 'use type="system"')
        for parameter in _parameters(component):
            if not parameter.name:
                yield Diagnostic("URDF325", f"ros2_control '{name}': a <param> has no name", parameter.place, None)
    yield from _commanded_twice(subject)


def _children(element: Element, component: str) -> Iterator[Diagnostic]:
    """Unknown elements and duplicate interfaces of a joint, a sensor or a gpio."""
    if element.tag not in ("joint", "sensor", "gpio"):
        return
    what = f"ros2_control '{component}': {element.tag} '{element.attributes.get('name', '')}'"
    seen: set[tuple[str, str]] = set()
    for child in element.children:
        if child.tag not in PARTS and ":" not in child.tag:
            message = f"{what} has the unknown element <{child.tag}>; it is ignored"
            yield Diagnostic("URDF325", message, child.place, did_you_mean(child.tag, PARTS, kind="known"), "warning")
        interface = child.tag, child.name
        if child.tag.endswith("_interface") and interface[1] and interface in seen:
            yield Diagnostic("URDF325", f"{what} has duplicate <{child.tag}> '{interface[1]}'", child.place, None)
        seen.add(interface)


def _commanded_twice(subject: Subject) -> Iterator[Diagnostic]:
    """A command interface of one joint in two components, or in a component of type sensor."""
    sensors = {
        component.attributes.get("name", "")
        for component in subject.description.root.all("ros2_control")
        if component.attributes.get("type", "").strip() == "sensor"
    }
    owners: dict[tuple[str, str], ControlledJoint] = {}
    for joint in controlled_joints(subject):
        for interface in joint.commands:
            name = interface.name
            what = f"ros2_control '{joint.component}': command interface '{name}' of joint '{joint.name}'"
            if joint.component in sensors:
                hint = 'use type="system", or keep only state interfaces'
                yield Diagnostic("URDF325", f"{what} is not allowed in a sensor", interface.place, hint)
            owner = owners.setdefault((joint.name, name), joint)
            if name and owner.component != joint.component:
                message = f"{what} is already in ros2_control '{owner.component}'"
                yield Diagnostic("URDF325", message, interface.place, "keep it in one component")


def _parameters(element: Element) -> Iterator[Element]:
    for child in element.children:
        if child.tag == "param":
            yield child
        yield from _parameters(child)
