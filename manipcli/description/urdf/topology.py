"""Check that the links and joints of a description form one tree."""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.core.text import listed
from manipcli.description.elements import Joint
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import Reader


def check_tree(
    reader: Reader,
    links: Mapping[str, Element],
    joints: Mapping[str, Joint | None],
    elements: Mapping[str, Element],
    *,
    complete: bool,
) -> str:
    """Name of the root link, or '' with findings: undefined links, two parents, loops, several roots.

    Args:
        reader: receives the findings.
        links: <link> by name.
        joints: by name; None for a joint that could not be read.
        elements: <joint> by name.
        complete: `joints` has all joints of the description; False if some have a missing or duplicate name.
    """
    before = len(reader.findings)
    parent_joint: dict[str, Joint] = {}
    for name, joint in joints.items():
        if joint is None:
            continue
        element = elements[name]
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                message = f"joint '{name}': {role} link '{link}' is not in the description"
                reader.report("URDF006", message, (element.first(role) or element).place, hint=reader.near(link, links))
        if joint.parent == joint.child:
            reader.report("URDF083", f"joint '{name}' connects link '{joint.parent}' to itself", element.place)
        elif joint.child in parent_joint:
            other = parent_joint[joint.child].name
            message = f"link '{joint.child}' is the child of two joints, '{other}' and '{name}'"
            hint = f"the first is at {elements[other].place}"
            reader.report("URDF082", message, (element.first("child") or element).place, hint=hint)
        else:
            parent_joint[joint.child] = joint
    loops = _loops(links, parent_joint)
    for loop in loops:
        message = f"links form a loop: {_shown(loop)}"
        # The last joint in the file most likely closed it.
        closing = max((elements[parent_joint[link].name] for link in loop), key=_line)
        hint = "remove one joint: a URDF is a tree"
        reader.report("URDF081", message, closing.place, hint=hint)
    if not complete or len(reader.findings) > before or None in joints.values():
        return ""
    roots = [link for link in links if link not in parent_joint]
    if len(roots) > 1:
        _report_roots(reader, roots, links, parent_joint)
        return ""
    return roots[0]


def _report_roots(
    reader: Reader, roots: list[str], links: Mapping[str, Element], parent_joint: Mapping[str, Joint]
) -> None:
    """Reports the links that are not connected to the largest tree, at the first of them."""
    root_of: dict[str, str] = {}
    for link in links:
        path = []
        at = link
        while at not in root_of and at in parent_joint:
            path.append(at)
            at = parent_joint[at].parent
        root = root_of.setdefault(at, at)
        root_of |= dict.fromkeys(path, root)
    size = {root: sum(top == root for top in root_of.values()) for root in roots[:50]}
    largest = max(size, key=lambda root: size[root])
    others = [root for root in roots if root != largest]
    unreached = [link for link, root in root_of.items() if root != largest]
    message = (
        f"the description has {len(roots)} root links: {listed(map(repr, roots))}; expected 1; "
        f"not connected to '{largest}': {listed(unreached)}"
    )
    hint = f"connect '{others[0]}' to '{largest}' with a fixed joint, or delete it"
    reader.report("URDF007", message, links[others[0]].place, hint=hint)


def _shown(loop: list[str]) -> str:
    shown = loop if len(loop) <= 12 else [*loop[:11], "..."]
    return " -> ".join([*shown, loop[0]])


def _line(element: Element) -> tuple[int, int]:
    return (element.place.line, element.place.column) if element.place is not None else (0, 0)


def _loops(links: Mapping[str, Element], parent_joint: Mapping[str, Joint]) -> list[list[str]]:
    """Every loop once, as its links with parents first."""
    done: set[str] = set()
    loops = []
    for link in links:
        path: dict[str, None] = {}
        at: str | None = link
        while at is not None and at not in done and at not in path:
            path[at] = None
            at = parent_joint[at].parent if at in parent_joint else None
        if at is not None and at in path:
            names = list(path)
            loops.append(names[names.index(at) :][::-1])
        done.update(path)
    return loops


def depth_first(root: str, joints: Mapping[str, Joint]) -> tuple[Joint, ...]:
    """The joints of a tree in depth-first order, siblings in the order of the file."""
    children: dict[str, list[Joint]] = {}
    for joint in joints.values():
        children.setdefault(joint.parent, []).append(joint)
    ordered: list[Joint] = []
    stack = children.get(root, [])[::-1]
    while stack:
        joint = stack.pop()
        ordered.append(joint)
        stack += children.get(joint.child, [])[::-1]
    return tuple(ordered)
