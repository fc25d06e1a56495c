"""Under which names a ROS 2 log tells of its robots: the usual ones, or those of a namespace, as `/r1/joint_states`."""

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
    """What a topic is: one of the usual ones, of the robot in a `namespace`; "" is none."""

    usual: str
    namespace: str


def meant(types: Mapping[str, str]) -> dict[str, Meant]:
    """The topics of a log that tell of a robot, by their names; where one has its usual name, that alone.

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
    """Those that tell of robots; more than one are several robots."""
    return tuple(sorted({one.namespace for one in known if one.namespace}))
