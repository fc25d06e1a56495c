"""Bad numbers where only other programs read them."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.located_xml import Element
from manipcli.model.urdf_numbers import Reader

_COUNTS: Final[dict[str, dict[str, int]]] = {
    "safety_controller": dict.fromkeys(("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"), 1),
    "calibration": dict.fromkeys(("rising", "falling", "reference_position"), 1),
    "limit": dict.fromkeys(("lower", "upper", "velocity", "effort", "acceleration", "deceleration", "jerk"), 1),
    "mimic": dict.fromkeys(("multiplier", "offset"), 1),
    "axis": {"xyz": 3},
}


def _find(subject: Subject) -> Iterator[Finding]:
    told = {(finding.message, finding.place) for finding in subject.parts.findings}
    for joint in subject.description.root.all("joint"):
        reader = Reader()
        for element in joint.children:
            _read(reader, element)
        for finding in reader.findings:
            if (finding.message, finding.place) not in told:
                message = f"{finding.message} (manipcli does not read it here)"
                yield Finding("URDF067", message, finding.place, severity="warning")


def _read(reader: Reader, element: Element) -> None:
    for attribute, count in _COUNTS.get(element.tag, {}).items():
        reader.numbers(element, attribute, count)


CHECK = Check(
    code="URDF067",
    name="unread-number",
    tier="schema",
    severity="warning",
    summary="A number that only other programs read is none",
    reason=(
        "Safety controllers, calibrations and the axis of a fixed joint mean nothing to a simulation, but other "
        "programs refuse the joint, or the file, for a bad number in them."
    ),
    bad=(
        '<robot name="r">'
        '<link name="base"/><link name="tip"/>'
        '<joint name="j" type="fixed"><parent link="base"/><child link="tip"/><calibration rising="soon"/></joint>'
        "</robot>"
    ),
    find=_find,
)
