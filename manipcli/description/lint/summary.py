"""Summary of a description, valid or not: counts, groups, mass, reach, and its tree as text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.description.elements import Joint
from manipcli.description.expanded import Description
from manipcli.description.lint.guess_groups import GuessedGroup, guess_groups
from manipcli.description.packages import NotFound
from manipcli.description.urdf.urdf import Parts

SWEEP: Final = 24
"""Positions tried per joint when the reach is estimated."""
MOST_LINES: Final = 2000
"""Most lines of a tree."""


@dataclass(frozen=True, slots=True)
class Summary:
    """Contents of a description. The counts are of what is written, valid or not.

    Attributes:
        name: of the robot.
        root: the root link; '' without one.
        links, joints, moving, transmissions: counts; `moving` joints are those that are not fixed.
        dof: number of moving joints that are not mimic joints.
        types: number of joints of each type, ((type, number), ...).
        mimics: number of mimic joints.
        groups: guessed; empty if there are errors.
        mass: of all links [kg].
        massless: number of child links of moving joints that have no mass.
        reach: largest distance of a chain's tip from the chain's first joint [m]; 0 without a chain.
        meshes, meshes_found: number of mesh files that are named, and of those that exist.
    """

    name: str
    root: str
    links: int
    joints: int
    moving: int
    dof: int
    types: tuple[tuple[str, int], ...]
    mimics: int
    transmissions: int
    groups: tuple[GuessedGroup, ...]
    mass: float
    massless: int
    reach: float
    meshes: int
    meshes_found: int


def summarise(description: Description, parts: Parts) -> Summary:
    """The summary of a description."""
    root = description.root
    joints = root.all("joint")
    types = Counter(joint.attributes.get("type", "") for joint in joints)
    moving = len(joints) - types["fixed"]
    mimics = sum(joint.first("mimic") is not None and joint.attributes.get("type") != "fixed" for joint in joints)
    groups = guess_groups(parts.root, parts.joints) if parts.root else ()
    named, there = _meshes(description)
    moved = {joint.child for joint in parts.joints if joint.moves}
    return Summary(
        name=parts.name,
        root=parts.root,
        links=len(root.all("link")),
        joints=len(joints),
        moving=moving,
        dof=moving - mimics,
        types=tuple(sorted(types.items())),
        mimics=mimics,
        transmissions=sum(len(each.all("transmission")) for each in (root, *root.all("ros2_control"))),
        groups=groups,
        mass=sum(link.inertial.mass for link in parts.links if link.inertial is not None),
        massless=sum(link.inertial is None for link in parts.links if link.name in moved),
        reach=max((_reach(parts, group) for group in groups if group.kind == "chain"), default=0.0),
        meshes=named,
        meshes_found=there,
    )


def _meshes(description: Description) -> tuple[int, int]:
    """How many mesh files are named, and how many of them exist."""
    holders = [each for link in description.root.all("link") for each in link.children]
    shapes = [shape for each in holders for shape in each.all("geometry")]
    uris = {mesh.attributes.get("filename", "").strip() for shape in shapes for mesh in shape.all("mesh")}
    found = 0
    for uri in uris:
        try:
            description.packages.resolve(uri)
            found += 1
        except NotFound:
            continue
    return len(uris), found


def _reach(parts: Parts, group: GuessedGroup) -> float:
    """Largest distance found of a chain's tip from the origin of its first joint [m], by coordinate ascent.

    A lower bound: each joint in turn goes to the best of `SWEEP` positions, in three rounds.
    """
    path = _path(parts, group)
    ranges = [_range(joint) for joint in path]
    q = np.array([(lower + upper) / 2.0 + 0.1 * (upper - lower) for lower, upper in ranges])
    best = 0.0
    for _ in range(3):
        for k, (lower, upper) in enumerate(ranges):
            if lower == upper:
                continue
            tried = np.repeat(q[None], SWEEP, axis=0)
            tried[:, k] = np.linspace(lower, upper, SWEEP)
            distance = np.linalg.norm(_tip(path, tried), axis=1)
            q = tried[int(distance.argmax())]
            best = max(best, float(distance.max()))
    return best if np.isfinite(best) else 0.0


def _path(parts: Parts, group: GuessedGroup) -> list[Joint]:
    """The joints from the first of a chain to its tip, including fixed joints."""
    by_child = {joint.child: joint for joint in parts.joints}
    path = []
    at = group.tip
    while at in by_child and at != group.base:
        path.append(by_child[at])
        at = by_child[at].parent
    path.reverse()
    while path and not path[0].moves:
        path.pop(0)
    return path[:100]


def _range(joint: Joint) -> tuple[float, float]:
    if not joint.moves or joint.mimic is not None:
        return 0.0, 0.0
    if joint.type == "prismatic":
        return joint.limits.lower or 0.0, joint.limits.upper or 0.0
    lower = joint.limits.lower if joint.limits.lower is not None else -np.pi
    upper = joint.limits.upper if joint.limits.upper is not None else np.pi
    return max(lower, -np.pi), min(upper, np.pi)


def _tip(path: Sequence[Joint], q: Array) -> Array:
    """Positions (m, 3) of the tip for m joint positions (m, n), from the origin of the first joint."""
    p = np.zeros((len(q), 3))
    for k in range(len(path) - 1, -1, -1):
        joint = path[k]
        if joint.type == "prismatic":
            p = p + q[:, k, None] * joint.axis
        elif joint.moves:
            p = _rotated(joint.axis, q[:, k], p)
        if k > 0:
            p = p @ joint.X_PJ.R.T + joint.X_PJ.p
    return p


def _rotated(axis: Array, angles: Array, p: Array) -> Array:
    """Rodrigues: p cos a + (n x p) sin a + n (n . p)(1 - cos a), row by row."""
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return np.asarray(p * cos + np.cross(axis, p) * sin + axis * (p @ axis)[:, None] * (1.0 - cos))


def tree_lines(parts: Parts) -> tuple[str, ...]:
    """The tree as far as it could be read: each link with the joint that carries it."""
    children: dict[str, list[Joint]] = {}
    for joint in parts.joints:
        children.setdefault(joint.parent, []).append(joint)
    carried = {joint.child for joint in parts.joints}
    lines: list[str] = []
    seen: set[str] = set()
    for top in [link.name for link in parts.links if link.name not in carried]:
        lines.append(top)
        stack = [(joint, "", k == 0) for k, joint in enumerate(reversed(children.get(top, [])))]
        while stack:
            joint, indent, last = stack.pop()
            if len(lines) >= MOST_LINES:
                return (*lines, "...")
            follows = f", mimics {joint.mimic.joint}" if joint.mimic is not None else ""
            repeated = " (already above)" if joint.child in seen else ""
            branch = "└─" if last else "├─"
            lines.append(f"{indent}{branch} {joint.child}  [{joint.name}: {joint.type}{follows}]{repeated}")
            if joint.child in seen:
                continue
            seen.add(joint.child)
            below = indent + ("   " if last else "│  ")
            below = below if len(below) < 200 else below[:200]
            stack += [(each, below, k == 0) for k, each in enumerate(reversed(children.get(joint.child, [])))]
    return tuple(lines)
