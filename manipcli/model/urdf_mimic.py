"""Mimic joints: their targets exist and move, and follow no one themselves once chains are multiplied out."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from manipcli.core.errors import Place
from manipcli.core.text import did_you_mean
from manipcli.model.robot import Joint, Mimic
from manipcli.model.urdf_numbers import Reader


def resolve_mimics(
    reader: Reader,
    joints: Mapping[str, Joint],
    declared: Sequence[str],
    places: Mapping[tuple[str, str], Place],
) -> dict[str, Joint]:
    """The joints, each mimic following an independent joint: q = m1 (m2 q' + o2) + o1 = (m1 m2) q' + (m1 o2 + o1).

    Args:
        reader: takes the findings: unknown target, itself, a fixed joint, a circle.
        joints: those that could be read.
        declared: names of all joints of the description.
        places: where they are written.
    """
    found: dict[str, Joint] = {}
    for name, joint in joints.items():
        mimic = joint.mimic
        visited = [name]
        while mimic is not None and mimic.joint in joints:
            target = joints[mimic.joint]
            if target.name in visited:
                circle = " -> ".join([*visited, target.name])
                what = "itself" if len(visited) == 1 else f"joints in a circle ({circle})"
                reader.report("URDF014", f"joint '{name}' mimics {what}", places.get(("joint", name)))
                mimic = None
                break
            if not target.moves:
                message = f"joint '{name}' mimics '{target.name}', which is fixed"
                reader.report("URDF014", message, places.get(("joint", name)))
                mimic = None
                break
            if target.mimic is None:
                break
            visited.append(target.name)
            inner = target.mimic
            mimic = Mimic(
                joint=inner.joint,
                multiplier=mimic.multiplier * inner.multiplier,
                offset=mimic.multiplier * inner.offset + mimic.offset,
            )
        if mimic is not None and mimic.joint not in declared:
            message = f"joint '{name}' mimics '{mimic.joint}', which is not in the description"
            reader.report("URDF014", message, places.get(("joint", name)), hint=did_you_mean(mimic.joint, declared))
            mimic = None
        found[name] = dataclasses.replace(joint, mimic=mimic)
    return found
