"""The links and joints of a description form one tree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from manipcli.core.errors import Place
from manipcli.core.text import did_you_mean
from manipcli.model.robot import Joint
from manipcli.model.urdf_numbers import Reader


def check_tree(
    reader: Reader,
    links: Sequence[str],
    joints: Mapping[str, Joint | None],
    places: Mapping[tuple[str, str], Place],
) -> str:
    """Name of the root link, or '' with findings: undefined links, two parents, loops, several roots.

    Args:
        reader: takes the findings.
        links: names of all links.
        joints: by name; None for one that could not be read, whose links are unknown.
        places: where they are written.
    """
    before = len(reader.findings)
    parent_joint: dict[str, Joint] = {}
    for name, joint in joints.items():
        if joint is None:
            continue
        place = places.get(("joint", name))
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                message = f"joint '{name}': {role} link '{link}' is not in the description"
                reader.report("URDF006", message, place, hint=did_you_mean(link, links))
        if joint.parent == joint.child:
            reader.report("URDF007", f"joint '{name}' joins link '{joint.parent}' to itself", place)
        elif joint.child in parent_joint:
            other = parent_joint[joint.child].name
            message = f"link '{joint.child}' is the child of two joints, '{other}' and '{name}'"
            reader.report("URDF007", message, place)
        else:
            parent_joint[joint.child] = joint
    if len(reader.findings) > before or any(joint is None for joint in joints.values()):
        return ""
    roots = [link for link in links if link not in parent_joint]
    loops = _loops(links, parent_joint)
    for loop in loops:
        message = "links form a loop: " + " -> ".join([*loop, loop[0]])
        reader.report("URDF007", message, places.get(("link", loop[0])))
    if len(roots) > 1:
        names = ", ".join(f"'{root}'" for root in roots)
        message = f"the description has {len(roots)} root links: {names}; expected one tree"
        reader.report("URDF007", message, places.get(("link", roots[1])), hint="join them with a fixed joint")
    return roots[0] if len(roots) == 1 and not loops else ""


def _loops(links: Sequence[str], parent_joint: Mapping[str, Joint]) -> list[list[str]]:
    """Every circle once, each as the links on it."""
    done: set[str] = set()
    loops = []
    for link in links:
        way: list[str] = []
        at: str | None = link
        while at is not None and at not in done and at not in way:
            way.append(at)
            at = parent_joint[at].parent if at in parent_joint else None
        if at is not None and at in way:
            loops.append(way[way.index(at) :][::-1])
        done.update(way)
    return loops


def depth_first(root: str, joints: Mapping[str, Joint]) -> tuple[Joint, ...]:
    """The joints of a tree from its root, depth first, siblings in the order of the file."""
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
