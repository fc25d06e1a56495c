"""Joints of ros2_control that are not there or do not move."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import did_you_mean
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import controlled_joints
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    written = elements_by_name(subject.description.root, "joint")
    for joint in controlled_joints(subject):
        if joint.name not in written:
            message = f"ros2_control '{joint.component}': joint '{joint.name}' is not in the description"
            yield Finding("URDF320", message, joint.element.place, did_you_mean(joint.name, list(written)))
        elif written[joint.name].attributes.get("type") == "fixed":
            message = f"ros2_control '{joint.component}': joint '{joint.name}' is fixed"
            yield Finding("URDF320", message, joint.element.place, "take it out, or make the joint move")
    for component in subject.description.root.all("ros2_control"):
        own = [joint.attributes.get("name", "").strip() for joint in component.all("joint")]
        for transmission in component.all("transmission"):
            for element in transmission.all("joint"):
                name = element.attributes.get("name", "").strip()
                if name not in own:
                    what = f"ros2_control '{component.attributes.get('name', '')}': joint '{name}' of transmission "
                    message = f"{what}'{transmission.attributes.get('name', '')}' is not one of its joints"
                    yield Finding("URDF320", message, element.place, did_you_mean(name, own))


CHECK = Check(
    code="URDF320",
    name="control-joint",
    tier="readiness",
    severity="error",
    summary="A <ros2_control> names a joint that is unknown or fixed, or its transmission one that it does not have",
    reason="The controller manager refuses the whole description at start-up.",
    bad=one_joint(
        more='<ros2_control name="c" type="system"><hardware><plugin>p/P</plugin></hardware>'
        '<joint name="k"><command_interface name="position"/></joint></ros2_control>'
    ),
    find=_find,
)
