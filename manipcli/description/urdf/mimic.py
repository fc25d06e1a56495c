"""Mimic joints: their targets exist and move, and follow no one themselves once chains are multiplied out."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from manipcli.core.errors import Place
from manipcli.description.elements import Joint, Mimic
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import Reader


def resolve_mimics(reader: Reader, joints: Mapping[str, Joint], elements: Mapping[str, Element]) -> dict[str, Joint]:
    """The joints, each mimic following an independent joint: q = m1 (m2 q' + o2) + o1 = (m1 m2) q' + (m1 o2 + o1).

    Args:
        reader: takes the findings: unknown target, itself, a fixed joint, multiplied by 0, a circle.
        joints: those that could be read.
        elements: <joint> of every joint of the description.
    """
    direct = {name: _direct(reader, joint, joints, elements) for name, joint in joints.items()}
    resolved: dict[str, Mimic | None] = {}
    for start in joints:
        way: dict[str, Mimic] = {}
        at = start
        while at not in resolved and at not in way:
            mimic = direct[at]
            if mimic is None:
                resolved[at] = None
                break
            way[at] = mimic
            at = mimic.joint
        if at in way:
            circle = list(way)[list(way).index(at) :]
            shown = " -> ".join([*circle[:12], *(["..."] if len(circle) > 12 else []), at])
            reader.report("URDF084", f"joints mimic each other in a circle: {shown}", _place(elements, at))
            resolved |= dict.fromkeys(circle)
        for name, mimic in reversed(way.items()):
            if name not in resolved:
                resolved[name] = _followed(mimic, resolved[mimic.joint])
    return {name: dataclasses.replace(joint, mimic=resolved[name]) for name, joint in joints.items()}


def _direct(reader: Reader, joint: Joint, joints: Mapping[str, Joint], elements: Mapping[str, Element]) -> Mimic | None:
    """Whom a joint says it follows; None with a finding where it cannot."""
    mimic = joint.mimic
    if mimic is None:
        return None
    place = _place(elements, joint.name)
    if mimic.joint not in elements:
        message = f"joint '{joint.name}' mimics '{mimic.joint}', which is not in the description"
        reader.report("URDF014", message, place, hint=reader.near(mimic.joint, elements))
    elif mimic.joint == joint.name:
        reader.report("URDF084", f"joint '{joint.name}' mimics itself", place)
    elif mimic.joint in joints and not joints[mimic.joint].moves:
        reader.report("URDF014", f"joint '{joint.name}' mimics '{mimic.joint}', which is fixed", place)
    elif mimic.multiplier == 0.0:
        message = f"joint '{joint.name}' mimics '{mimic.joint}' with a multiplier of 0: it follows nothing"
        hint = f'make it type="fixed", with its <origin> where it stands at {mimic.offset:g}'
        reader.report("URDF014", message, place, hint=hint)
    elif mimic.joint in joints:
        return mimic
    return None


def _followed(mimic: Mimic, inner: Mimic | None) -> Mimic:
    """`mimic` of a joint that itself follows as `inner` says."""
    if inner is None:
        return mimic
    return Mimic(
        joint=inner.joint,
        multiplier=mimic.multiplier * inner.multiplier,
        offset=mimic.multiplier * inner.offset + mimic.offset,
    )


def _place(elements: Mapping[str, Element], joint: str) -> Place | None:
    element = elements[joint]
    return (element.first("mimic") or element).place
