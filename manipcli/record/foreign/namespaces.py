"""Robot topics of a ROS 2 log: the usual names, or names in a namespace such as `/r1/joint_states`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from manipcli.record import channels, schemas

TYPES: Final = {
    channels.ROBOT_DESCRIPTION: schemas.STRING,
    channels.JOINT_STATES: schemas.JOINT_STATE,
    channels.TF: schemas.TF_MESSAGE,
    channels.TF_STATIC: schemas.TF_MESSAGE,
}
"""The usual topics of a robot, and their types."""


@dataclass(frozen=True, slots=True)
class Meant:
    """Meaning of a topic: a usual topic of the robot in `namespace`; "" without a namespace."""

    usual: str
    namespace: str


def meant(types: Mapping[str, str]) -> dict[str, Meant]:
    """The robot topics of a log by name; a topic with its usual name excludes namespaces.

    Args:
        types: topic -> type.
    """
    found: dict[str, Meant] = {}
    for usual, kind in TYPES.items():
        if usual in types:
            found |= {usual: Meant(usual, "")} if types[usual] == kind else {}
            continue
        for name in sorted(types):
            if name.endswith(usual) and types[name] == kind:
                found[name] = Meant(usual, name.removesuffix(usual))
    return found


def namespaces(known: Iterable[Meant]) -> tuple[str, ...]:
    """The namespaces of the robots of a log."""
    return tuple(sorted({meaning.namespace for meaning in known if meaning.namespace}))
