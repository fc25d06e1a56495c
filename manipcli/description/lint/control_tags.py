"""The parts of <ros2_control> and <transmission> elements that several checks use."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from manipcli.description.lint.check import Subject
from manipcli.description.located_xml import Element
from manipcli.description.transmissions import TRANSMISSIONS

SIZES: Final = {member.type: member.size for member in TRANSMISSIONS}
"""Number of joints (and of actuators) of each transmission type."""


@dataclass(frozen=True, slots=True)
class ControlledJoint:
    """A <joint> of a <ros2_control>; `commands` are its <command_interface> elements."""

    component: str
    name: str
    element: Element
    commands: tuple[Element, ...]


@dataclass(frozen=True, slots=True)
class WrittenTransmission:
    """A <transmission>: `type` without its package; `ros1`: it is a child of <robot>."""

    name: str
    type: str
    ros1: bool
    element: Element
    joints: tuple[Element, ...]
    actuators: tuple[Element, ...]


def controlled_joints(subject: Subject) -> Iterator[ControlledJoint]:
    for component in subject.description.root.all("ros2_control"):
        for joint in component.all("joint"):
            yield ControlledJoint(
                component=component.attributes.get("name", ""),
                name=joint.name,
                element=joint,
                commands=joint.all("command_interface"),
            )


def transmissions(subject: Subject) -> Iterator[WrittenTransmission]:
    """The transmissions that state a type; the reader reports the others."""
    root = subject.description.root
    holders = [(root, True), *((control, False) for control in root.all("ros2_control"))]
    for holder, ros1 in holders:
        for element in holder.all("transmission"):
            kind = element.first("type") or element.first("plugin")
            if kind is not None and kind.text:
                yield WrittenTransmission(
                    name=element.name or "(without a name)",
                    type=kind.text.strip().rpartition("/")[2],
                    ros1=ros1,
                    element=element,
                    joints=element.all("joint"),
                    actuators=element.all("actuator"),
                )
