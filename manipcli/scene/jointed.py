"""Jointed things from a URDF or xacro file: bodies for its root and for each link that a joint moves, and their joints.

The root has the name of the body in the task, a moved link `BODY/LINK`. A link on a fixed joint belongs to the link
that it is fixed to, and is a part of it, `BODY/LINK`, about the middle of its shapes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from manipcli.core.errors import Loc
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.text import did_you_mean, escape
from manipcli.core.units import readable
from manipcli.description.elements import Inertial, Joint, Link
from manipcli.description.lint.rigid import box_about
from manipcli.description.urdf.urdf import Parts
from manipcli.scene.body_files import in_parts, principal
from manipcli.scene.body_shapes import COLORS, BodyShape
from manipcli.scene.hollow import hollow_of
from manipcli.scene.joints import SceneJoint
from manipcli.scene.scene import SEPARATOR, Frame
from manipcli.shapes.primitives import Geometry, Rgba
from manipcli.spec.scene import BodySpec, SceneJointSpec, UrdfSpec


class Fault(NamedTuple):
    """An error about a jointed thing; `loc`: below its block in the task."""

    code: str
    message: str
    loc: Loc
    hint: str | None = None


@dataclass(frozen=True, slots=True)
class Jointed:
    """A jointed thing before it has a pose.

    Attributes:
        shapes: of the root and of every link that a joint moves, by the name of the body; the root first.
        joints: parents before children.
        frames: parts, for the links on fixed joints.
    """

    shapes: Mapping[str, BodyShape]
    joints: tuple[SceneJoint, ...]
    frames: tuple[Frame, ...]


def jointed(name: str, spec: BodySpec, parts: Parts) -> tuple[Jointed, tuple[Fault, ...]]:
    """A body from a file with several links, and all that is wrong with what is written about it.

    Raises:
        UnusableMesh: convex parts of a mesh cannot be made.
    """
    assert spec.urdf is not None
    links, X_BL, owner = {link.name: link for link in parts.links}, {parts.root: Transform.identity()}, {}
    owner[parts.root] = name
    joints: list[SceneJoint] = []
    frames: list[Frame] = []
    members: dict[str, list[Link]] = {name: [links[parts.root]]}
    faults = list(_refused(name, spec, parts))
    for joint in parts.joints:  # parents before children
        body, X_BJ = owner[joint.parent], X_BL[joint.parent] @ joint.X_PJ
        if joint.moves:
            owner[joint.child], X_BL[joint.child] = f"{name}{SEPARATOR}{joint.child}", Transform.identity()
            members[owner[joint.child]] = [links[joint.child]]
            made, wrong = _joint(name, joint, X_BJ, body, owner[joint.child], (spec.joints or {}).get(joint.name))
            joints.append(made)
            faults += wrong
        else:
            owner[joint.child], X_BL[joint.child] = body, X_BJ
            members[body].append(links[joint.child])
            frames.append(_part(f"{name}{SEPARATOR}{joint.child}", body, X_BJ, links[joint.child]))
    shapes = {
        body: _shape([(link, X_BL[link.name]) for link in group], spec.urdf, spec.color, moved=body != name)
        for body, group in members.items()
    }
    if not any(shape.geometries for shape in shapes.values()):
        faults.append(Fault("TASK222", f"no link of '{spec.urdf.file}' has a collision shape", ("urdf",)))
    moved = {joint.child: joint.name for joint in joints}
    for body, shape in shapes.items():
        if body in moved and (shape.inertial is None or not shape.inertial.inertia.any()):
            message = (
                f"link '{escape(body.rpartition(SEPARATOR)[2])}' of body '{name}' is moved by a joint but has no mass"
            )
            faults.append(Fault("TASK362", message, ("urdf",), "add an <inertial> with mass and moments to the link"))
    return Jointed(shapes, tuple(joints), tuple(frames)), tuple(faults)


def _refused(name: str, spec: BodySpec, parts: Parts) -> Iterator[Fault]:
    """TASK360: unknown joint. TASK363: a key that does not go with joints. TASK364: what the file must not have."""
    moving = [joint.name for joint in parts.joints if joint.moves]
    for joint in spec.joints or {}:
        if joint not in moving:
            message = f"body '{name}' has no joint '{escape(joint)}' that moves"
            hint = did_you_mean(joint, moving, kind="joints") if moving else "its file has no joint that moves"
            yield Fault("TASK360", message, ("joints", joint), hint)
    if not moving:
        return
    for key, given, hint in (
        ("count", spec.count is not None, "write one body for each"),
        ("known", spec.known is not None, "remove `known`: where a thing with joints is, is known exactly"),
        ("mass", spec.mass is not None, "remove `mass`: its links have the masses of the file"),
    ):
        if given:
            yield Fault("TASK363", f"body '{name}' has joints and `{key}`", (key,), hint)
    for each in parts.joints:
        if each.moves and each.mimic is not None:
            message = f"joint '{escape(each.name)}' of body '{name}' mimics another one, which a body cannot do"
            yield Fault("TASK364", message, ("urdf",), "remove <mimic>, or let one joint move both links")
        if each.type == "revolute" and math.tau < np.ptp(each.limits.range) < math.inf:
            message = f"joint '{escape(each.name)}' of body '{name}' turns by more than one revolution"
            hint = "make it `continuous`, or narrow its limits: its angle is known up to whole revolutions"
            yield Fault("TASK364", message, ("urdf",), hint)
    for word in (*(link.name for link in parts.links), *moving):
        if SEPARATOR in word or "[" in word:
            message = f"the name '{escape(word)}' in the file of body '{name}' contains '/' or '['"
            yield Fault("TASK364", message, ("urdf",), "rename it: it is a part of the name of a body or a joint")


def _joint(
    name: str, joint: Joint, X_PJ: Transform, parent: str, child: str, spec: SceneJointSpec | None
) -> tuple[SceneJoint, list[Fault]]:
    """The joint with what the task adds to the file; TASK361: a position outside its limits."""
    lower, upper = joint.limits.range
    free = joint.type == "continuous" or (math.isinf(lower) and math.isinf(upper))
    zero = joint.limits.nearest(0.0)
    spec = spec or SceneJointSpec()
    made = SceneJoint(
        name=f"{name}{SEPARATOR}{joint.name}",
        type="prismatic" if joint.type == "prismatic" else "continuous" if free else "revolute",
        parent=parent,
        child=child,
        X_PJ=X_PJ,
        axis=joint.axis,
        lower=lower,
        upper=upper,
        start=zero if spec.start is None else spec.start,
        damping=joint.damping if spec.damping is None else spec.damping,
        friction=joint.friction if spec.friction is None else spec.friction,
        stiffness=0.0 if spec.spring is None else spec.spring.stiffness,
        rest=0.0 if spec.spring is None else spec.spring.rest,
        closed=zero if spec.closed is None else spec.closed,
    )
    faults = []
    for word in ("start", "closed"):
        position = float(getattr(made, word))
        if not lower <= position <= upper:
            limits = f"{readable(lower, joint.unit)} to {readable(upper, joint.unit)}"
            message = (
                f"`{word}` of joint '{made.name}' is {readable(position, joint.unit)}, outside its limits {limits}"
            )
            faults.append(Fault("TASK361", message, ("joints", joint.name, word), joint.meant(position)))
    return made, faults


def _part(name: str, body: str, X_BL: Transform, link: Link) -> Frame:
    """The part for a link on a fixed joint: about the middle of its shapes, along the axes of the link."""
    box = box_about(link.collisions)
    if box is None:
        return Frame(name, body, X_BL)
    low, high = box
    return Frame(name, body, X_BL @ Transform.of(xyz=(low + high) / 2.0), frozen(high - low))


def _shape(links: Sequence[tuple[Link, Transform]], spec: UrdfSpec, rgba: Rgba | None, *, moved: bool) -> BodyShape:
    """The union of links that are fixed to each other, each at its pose in the body."""
    shapes: list[Geometry] = []
    for k, (link, X_BL) in enumerate(links):
        usual = COLORS["part" if moved and k > 0 else "moved" if moved else "urdf"]
        own = next((shape.rgba for shape in link.visuals if shape.rgba is not None), usual)
        for shape in link.collisions:
            shapes.append(replace(shape, X_LS=X_BL @ shape.X_LS, rgba=rgba or shape.rgba or own))
    geometries = in_parts(shapes, spec.collision)
    low, high = box_about(geometries) or (np.zeros(3), np.zeros(3))
    return BodyShape(
        geometries=geometries,
        interior=hollow_of(geometries),
        size=frozen(high - low),
        centre=frozen((high + low) / 2.0),
        inertial=_union([(link.inertial, X) for link, X in links if link.inertial is not None]),
    )


def _union(inertials: Sequence[tuple[Inertial, Transform]]) -> Inertial | None:
    """Mass properties of links that are fixed to each other, by the parallel axis theorem; None without mass."""
    mass = sum(each.mass for each, _ in inertials)
    if mass <= 0.0:
        return None
    poses = [(each, X_BL @ each.X_LI) for each, X_BL in inertials]
    centre: Array = sum((each.mass * X.p for each, X in poses), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for each, X in poses:
        d = X.p - centre
        inertia += X.R @ each.inertia @ X.R.T + each.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return principal(mass, centre, inertia)
