"""What ros2_control refuses in a description, each told with the name it is of."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import ManipcliError
from manipcli.description.lint.examine import examine
from manipcli.description.lint.samples import CUBE, INERTIAL, LIMIT
from manipcli.description.packages import Packages

HARDWARE = "<hardware><plugin>p/P</plugin></hardware>"
ATTRIBUTES = 'name="hw" type="system"'
EFFORT = '<command_interface name="effort"/><state_interface name="position"/>'


def description(control: str, *, inside: str = LIMIT, kind: str = "revolute", links: str = "") -> str:
    """Links a, b, c, joints `first` and `second` between them, what the second says, and a <ros2_control>."""
    body = INERTIAL + CUBE
    away = '<origin xyz="0 0 1"/>'
    return (
        f'<robot name="r"><link name="a"/><link name="b">{body}</link><link name="c">{body}</link>{links}'
        f'<joint name="first" type="revolute">{away}<parent link="a"/><child link="b"/>{LIMIT}</joint>'
        f'<joint name="second" type="{kind}">{away}<parent link="b"/><child link="c"/>{inside}</joint>{control}</robot>'
    )


def component(*inside: str, attributes: str = ATTRIBUTES, hardware: str = HARDWARE) -> str:
    return f"<ros2_control {attributes}>{hardware}{''.join(inside)}</ros2_control>"


def joint(name: str, more: str = EFFORT, attributes: str = "") -> str:
    return f'<joint name="{name}" {attributes}>{more}</joint>'


def gear(of: str = '<joint name="first" role="joint1"/>', name: str = ' name="t"', plugin: str = "Simple") -> str:
    kind = f"<plugin>transmission_interface/{plugin}Transmission</plugin>" if plugin else ""
    return f'<transmission{name}>{kind}{of}<actuator name="m" role="actuator1"/></transmission>'


BOTH = joint("first") + joint("second")
FOLLOWS = LIMIT + '<mimic joint="{}"/>'
SILENT = '<state_interface name="position"/>'


def sized(size: str) -> str:
    return description(component(joint("first", f'<state_interface name="position" size="{size}"/>')))


def rated(rate: str) -> str:
    return description(component(BOTH, attributes=f'{ATTRIBUTES} rw_rate="{rate}"'))


def ranged(low: float, high: float) -> str:
    bounds = f'<param name="min">{low}</param><param name="max">{high}</param>'
    return description(component(joint("first", f'<command_interface name="position">{bounds}</command_interface>')))


REFUSED = {
    "empty": ("", "not well-formed"),
    "another root": ('<robt name="r"/>', "the root element is <robt>"),
    "unknown element": (description(component(BOTH, '<jiont name="first"/>')), "'hw' has the unknown element <jiont>"),
    "no name": (description(component(BOTH, attributes='type="system"')), "a <ros2_control> has no name"),
    "no type": (description(component(BOTH, attributes='name="hw"')), "'hw' has type ''; expected system"),
    "no plugin": (description(component(BOTH, hardware="<hardware/>")), "'hw' has no <hardware> with a <plugin>"),
    "no role": (description(component(BOTH, gear('<joint name="first"/>'))), "'t': a joint has no role"),
    "no name of a transmission": (description(component(BOTH, gear(name=""))), "a SimpleTransmission has no name"),
    "no type of a transmission": (description(component(BOTH, gear(plugin=""))), "'t' has no <type>"),
    "parameter without a name": (
        description(component(BOTH, hardware="<hardware><plugin>p/P</plugin><param>3</param></hardware>")),
        "'hw': a <param> has no name",
    ),
    "parameter of an interface without a name": (
        description(component(joint("first", '<command_interface name="effort"><param>2</param></command_interface>'))),
        "'hw': a <param> has no name",
    ),
    "size -1": (sized("-1"), "'first': interface size is '-1'"),
    "size 1.5": (sized("1.5"), "'first': interface size is '1.5'"),
    "rate -1": (rated("-1"), "'hw': rw_rate is '-1'"),
    "rate 1.5": (rated("1.5"), "'hw': rw_rate is '1.5'"),
    "transmission of a joint elsewhere": (
        description(component(joint("first"), gear('<joint name="second" role="joint1"/>'))),
        "'hw': joint 'second' of transmission 't' is not one of its joints",
    ),
    "actuator of two joints": (
        description(component(BOTH, attributes='name="hw" type="actuator"')),
        "'hw' is an actuator with 2 joints",
    ),
    "unknown driver": (
        description(component(joint("second", SILENT)), inside=FOLLOWS.format("third")),
        "joint 'second' mimics 'third', which is not in the description",
    ),
    "driver elsewhere": (
        description(component(joint("second", SILENT)), inside=FOLLOWS.format("first")),
        "joint 'second' mimics 'first', which is not in this ros2_control",
    ),
    "mimic without one": (
        description(component(joint("first"), joint("second", attributes='mimic="true"'))),
        "joint 'second' has mimic=\"true\", but",
    ),
    "mimic with a command": (
        description(component(BOTH), inside=FOLLOWS.format("first")),
        "joint 'second' mimics 'first' and has a command interface",
    ),
    "fixed": (description(component(BOTH), inside="", kind="fixed"), "joint 'second' is fixed"),
    "two roots": (description(component(BOTH), links='<link name="z"/>'), "2 root links: 'a', 'z'"),
    "a range above the limits": (ranged(50, 60), "joint 'first': min 50 is outside its limits -1 to 1"),
    "a range below the limits": (ranged(-60, -50), "joint 'first': max -50 is outside its limits -1 to 1"),
    "a comma for a point": (
        description(
            component(
                joint("first", '<command_interface name="effort"><param name="max">0,5</param></command_interface>')
            )
        ),
        "'first': max is '0,5'; expected a finite number",
    ),
}
ACCEPTED = {
    "a range that leaves one position": ranged(1, 3),
    "two joints and a gear": description(component(BOTH, gear())),
    "a rate and a size": description(
        component(
            joint("first", '<state_interface name="position" size="1"/>'), attributes=f'{ATTRIBUTES} rw_rate="100"'
        )
    ),
    "a follower of a joint beside it": description(
        component(joint("first"), joint("second", SILENT)), inside=FOLLOWS.format("first")
    ),
    "a mimic joint that shall not follow": description(
        component(joint("first"), joint("second", attributes='mimic="false"')), inside=FOLLOWS.format("first")
    ),
    "an actuator of one joint": description(component(joint("first"), attributes='name="hw" type="actuator"')),
}


def errors(folder: Path, text: str) -> list[str]:
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    try:
        findings = examine(path, packages=Packages(path)).findings
    except ManipcliError as error:
        findings = error.findings
    return [finding.message for finding in findings if finding.severity == "error"]


@pytest.mark.parametrize("case", REFUSED)
def test_what_ros2_control_refuses_is_told_with_its_component_or_joint(tmp_path: Path, case: str) -> None:
    """Conformance 65."""
    text, told = REFUSED[case]
    assert any(told in message for message in errors(tmp_path, text)), errors(tmp_path, text)


@pytest.mark.parametrize("case", ACCEPTED)
def test_what_ros2_control_takes_has_no_error(tmp_path: Path, case: str) -> None:
    """Conformance 65: the same descriptions without their mistake."""
    assert errors(tmp_path, ACCEPTED[case]) == []
