"""Resolution of mimic joints: checks of their targets, and chains of mimic joints reduced to one step."""

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
        reader: receives the findings: target unknown, fixed or the joint itself, multiplier 0, a circle, a chain.
        joints: the joints that could be read.
        elements: <joint> of every joint in the description.
    """
    direct = {name: _direct(reader, joint, joints, elements) for name, joint in joints.items()}
    resolved: dict[str, Mimic | None] = {}
    for start in joints:
        path: dict[str, Mimic] = {}
        at = start
        while at not in resolved and at not in path:
            mimic = direct[at]
            if mimic is None:
                resolved[at] = None
                break
            path[at] = mimic
            at = mimic.joint
        if at in path:
            circle = list(path)[list(path).index(at) :]
            shown = " -> ".join([*circle[:12], *(["..."] if len(circle) > 12 else []), at])
            reader.report("URDF084", f"joints mimic each other in a circle: {shown}", _place(elements, at))
            resolved |= dict.fromkeys(circle)
        for name, mimic in reversed(path.items()):
            if name not in resolved:
                inner = resolved[mimic.joint]
                resolved[name] = found = _followed(mimic, inner)
                if inner is not None:
                    message = (
                        f"joint '{name}' mimics '{mimic.joint}', which mimics '{direct_target(direct, mimic.joint)}': "
                        f"it follows '{found.joint}' with multiplier {found.multiplier:g} and offset {found.offset:g}"
                    )
                    hint = "write that: other programs follow only one step, or refuse it"
                    reader.report("URDF085", message, _place(elements, name), hint=hint, severity="note")
    return {name: dataclasses.replace(joint, mimic=resolved[name]) for name, joint in joints.items()}


def direct_target(direct: Mapping[str, Mimic | None], joint: str) -> str:
    """The joint that this one mimics itself."""
    mimic = direct[joint]
    return "" if mimic is None else mimic.joint


def _direct(reader: Reader, joint: Joint, joints: Mapping[str, Joint], elements: Mapping[str, Element]) -> Mimic | None:
    """The mimic as written; None with a finding if it is invalid."""
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
        message = f"joint '{joint.name}' mimics '{mimic.joint}' with multiplier 0: it never moves"
        hint = f'use type="fixed", with the <origin> at position {mimic.offset:g}'
        reader.report("URDF014", message, place, hint=hint)
    elif mimic.joint in joints:
        return mimic
    return None


def _followed(mimic: Mimic, inner: Mimic | None) -> Mimic:
    """`mimic` of a joint that is itself a mimic joint with `inner`."""
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
