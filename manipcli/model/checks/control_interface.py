"""Interfaces of ros2_control with unusual names."""

from collections.abc import Iterator
from difflib import get_close_matches
from typing import Final

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import controlled_joints
from manipcli.model.samples import one_joint

KNOWN: Final = ("position", "velocity", "effort", "acceleration", "torque", "force", "current", "temperature")
OTHERS: Final = ("absolute_position", "feedforward", "proportional", "integral", "derivative", "integral_clamp_max")


def _find(subject: Subject) -> Iterator[Finding]:
    """A name far from all that are known is somebody's own, which is allowed."""
    for joint in controlled_joints(subject):
        for interface in (*joint.commands, *joint.element.all("state_interface")):
            name = interface.attributes.get("name", "").strip()
            near = get_close_matches(name, KNOWN, n=1, cutoff=0.8) if name else ["position"]
            if name in KNOWN or name in OTHERS or not near:
                continue
            what = f"'{name}'" if name else "no name"
            message = f"ros2_control '{joint.component}': an interface of joint '{joint.name}' has {what}"
            yield Finding("URDF323", message, interface.place, f"did you mean '{near[0]}'?", "warning")


CHECK = Check(
    code="URDF323",
    name="control-interface",
    tier="readiness",
    severity="warning",
    summary="An interface of ros2_control has a name that no controller asks for, or none",
    reason="Controllers ask for position, velocity, effort or acceleration by exactly these names.",
    bad=one_joint(
        more='<ros2_control name="c" type="system"><hardware><plugin>p/P</plugin></hardware>'
        '<joint name="j"><command_interface name="postion"/></joint></ros2_control>'
    ),
    find=_find,
)
