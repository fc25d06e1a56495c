"""Mimic joints with a command interface, and others that ros2_control cannot make follow."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import controlled_joints
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import INERTIAL, LIMIT, one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    """`mimic="false"` at the joint of the component makes it independent there."""
    written = elements_by_name(subject.description.root, "joint")
    together = [(joint.component, joint.name) for joint in controlled_joints(subject)]
    for joint in controlled_joints(subject):
        mimic = written[joint.name].first("mimic") if joint.name in written else None
        said = joint.element.attributes.get("mimic", "").strip()
        what = f"ros2_control '{joint.component}': joint '{joint.name}'"
        if mimic is None and said == "true" and joint.name in written:
            message = f"{what} shall follow another (mimic), but the description has no <mimic> for it"
            yield Finding("URDF321", message, joint.element.place, None)
        if mimic is None or said == "false":
            continue
        target = mimic.attributes.get("joint", "").strip()
        if joint.commands:
            message = f"{what} follows '{target}' and has a command interface"
            yield Finding("URDF321", message, joint.commands[0].place, "keep its state interfaces only")
        if target in written and (joint.component, target) not in together:
            message = f"{what} follows '{target}', which is not one of this ros2_control"
            yield Finding("URDF321", message, joint.element.place, f"put '{target}' there too, or take it out")


CHECK = Check(
    code="URDF321",
    name="control-mimic",
    tier="readiness",
    severity="error",
    summary="A mimic joint has a command interface of its own, or nothing to follow",
    reason="It has no position of its own: two commands for one degree of freedom. ros2_control refuses it.",
    bad=one_joint(
        more='<link name="other">'
        + INERTIAL
        + '</link><joint name="k" type="revolute"><origin xyz="0 0 1"/><parent link="tip"/><child link="other"/>'
        + LIMIT
        + '<mimic joint="j"/></joint><ros2_control name="c" type="system"><hardware><plugin>p/P</plugin></hardware>'
        '<joint name="k"><command_interface name="position"/></joint></ros2_control>'
    ),
    find=_find,
)
