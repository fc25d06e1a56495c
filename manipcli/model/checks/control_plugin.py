"""Components of ros2_control without a plugin, name or type."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.samples import one_joint

TYPES: Final = ("system", "actuator", "sensor")


def _find(subject: Subject) -> Iterator[Finding]:
    for component in subject.description.root.all("ros2_control"):
        name = component.attributes.get("name", "").strip()
        hardware = component.first("hardware")
        plugin = hardware.first("plugin") if hardware is not None else None
        if not name:
            yield Finding("URDF322", "a <ros2_control> has no name", component.place, 'name="..."')
        if component.attributes.get("type", "").strip() not in TYPES:
            kind = component.attributes.get("type", "")
            message = f"ros2_control '{name}' is of type '{kind}'; expected {', '.join(TYPES)}"
            yield Finding("URDF322", message, component.place, 'type="system"')
        if plugin is None or not plugin.text.strip():
            message = f"ros2_control '{name}' has no <hardware> with a <plugin>"
            hint = "<hardware><plugin>mock_components/GenericSystem</plugin></hardware>"
            yield Finding("URDF322", message, (hardware or component).place, hint)


CHECK = Check(
    code="URDF322",
    name="control-plugin",
    tier="readiness",
    severity="error",
    summary="A <ros2_control> states no plugin, no name, or no known type",
    reason="The controller manager does not start with it.",
    bad=one_joint(
        more='<ros2_control name="c" type="system"><joint name="j"><command_interface name="position"/></joint>'
        "</ros2_control>"
    ),
    find=_find,
)
