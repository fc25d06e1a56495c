"""Writer of normalised URDF for logs and engines: exact numbers, short lines, supported elements only.

It avoids what PyBullet misreads silently: lines beyond 8191 bytes are cut, invalid numbers become 0, and a link without
an inertial gets a mass of 1 kg.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from manipcli.core.errors import Diagnostic, InvalidInput, Severity
from manipcli.core.geometry import Array, Transform
from manipcli.description.elements import Inertial, Joint, Link, TransmissionTag
from manipcli.description.urdf.joint import UNBOUNDED
from manipcli.model.inertials import ESTIMATE, massless_bodies
from manipcli.model.robot import RobotModel
from manipcli.shapes.mesh import clean_mesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Shape, Sphere, drawn_once

MAX_LINE = 4096
"""Longest line that is written [bytes]."""
NUDGE = 1e-6
"""Relative distance by which an engine's inertia is moved inside the triangle inequality after rounding."""


def portable_urdf(
    name: str, links: Sequence[Link], joints: Sequence[Joint], transmissions: Sequence[TransmissionTag]
) -> str:
    """The complete description as text with `package://` meshes; reading it gives the same links and joints,
    but whole meshes where links have convex parts of them."""
    lines = _head(name)
    for link in links:
        lines += _link(dataclasses.replace(link, collisions=drawn_once(link.collisions)), lambda mesh: mesh.uri)
    for joint in joints:
        lines += _joint(joint)
    for tag in transmissions:
        lines += _transmission(tag)
    return _text(lines)


def engine_urdf(robot: RobotModel, folder: Path) -> str:
    """The URDF for a physics engine: inertials, collision shapes, joints; meshes are rewritten by `clean_mesh`.

    A link without an inertial is written with mass 0. Limits include those of the robot file; mimic joints become
    independent joints.

    Args:
        robot: the robot.
        folder: receives the mesh files; keep it until the engine has read them.

    Raises:
        InvalidInput: a joint moves a link without mass, a line would be too long, or a collision mesh is damaged.
    """
    massless = massless_links(robot, "URDF040")
    if massless:
        raise InvalidInput(massless)
    lines = _head(robot.name)
    for link in robot.links:
        inertial = link.inertial or MASSLESS
        inertial = dataclasses.replace(inertial, inertia=inside_triangle(inertial.inertia))
        simulated = dataclasses.replace(link, inertial=inertial, visuals=())
        lines += _link(simulated, lambda mesh: str(clean_mesh(mesh, folder)))
    for joint in robot.joints:
        # Bullet would use the largest numbers as limits.
        free = joint.type == "revolute" and joint.limits.lower is None and joint.limits.upper is None
        lines += _joint(dataclasses.replace(joint, type="continuous") if free else joint)
    return _text(lines)


def links_urdf(links: Sequence[Link], joints: Sequence[Joint], folder: Path) -> str:
    """The URDF of a rigid or jointed body for a physics engine, without visuals; `folder` as in `engine_urdf`."""
    lines = _head("body")
    for link in links:
        inertial = link.inertial or MASSLESS
        inertial = dataclasses.replace(inertial, inertia=inside_triangle(inertial.inertia))
        lines += _link(dataclasses.replace(link, inertial=inertial), lambda mesh: str(clean_mesh(mesh, folder)))
    for joint in joints:
        lines += _joint(joint)
    return _text(lines)


MASSLESS = Inertial(mass=0.0, X_LI=Transform.identity(), inertia=np.zeros((3, 3)))


def massless_joints(robot: RobotModel) -> tuple[str, ...]:
    """Moving joints whose child link has no mass, including all links fixed to it."""
    massless = massless_bodies(robot.joints, {link.name for link in robot.links if link.inertial is not None})
    return tuple(joint.name for joint in robot.moving_joints if joint.child in massless)


def massless_links(robot: RobotModel, code: str, *, severity: Severity = "error") -> tuple[Diagnostic, ...]:
    """A finding for each child link of `massless_joints`: no engine with physics can simulate it."""
    found = []
    for name in massless_joints(robot):
        link = robot.link(robot.joint(name).child)
        message = f"link '{link.name}' has no mass (nor the links fixed to it) and is moved by joint '{name}'"
        hint = f"{ESTIMATE}, add an <inertial> to the link, or use an engine without physics"
        found.append(Diagnostic(code, message, link.place, hint, severity))
    return tuple(found)


def _head(name: str) -> list[str]:
    return ['<?xml version="1.0" encoding="utf-8"?>', f"<robot name={quoteattr(name)}>"]


def _text(lines: list[str]) -> str:
    lines.append("</robot>")
    for line in lines:
        if len(line.encode()) > MAX_LINE:
            message = f"a name or path is too long: {line.strip()[:120]}..."
            raise InvalidInput([Diagnostic(code="URDF041", message=message)])
    return "\n".join(lines) + "\n"


@functools.lru_cache(maxsize=4096)
def number(value: float) -> str:
    """Shortest text of the same double; never '-0.0'."""
    return repr(float(value) + 0.0)


def _numbers(values: Sequence[float] | Array) -> str:
    return " ".join(number(float(value)) for value in values)


def _attributes(values: Mapping[str, float | None]) -> str:
    return " ".join(f'{key}="{number(float(value))}"' for key, value in values.items() if value is not None)


def _origin(X: Transform, indent: str) -> list[str]:
    xyz, rpy = X.p, X.rpy
    if not xyz.any() and not rpy.any():
        return []
    return [f'{indent}<origin xyz="{_numbers(xyz)}" rpy="{_numbers(rpy)}"/>']


FileOf = Callable[[Mesh], str]
"""Gives the file name that is written for a mesh."""


def _link(link: Link, file_of: FileOf) -> list[str]:
    lines = [f"  <link name={quoteattr(link.name)}>"]
    inertial = link.inertial
    if inertial is not None:
        I = inertial.inertia  # noqa: E741  (the inertia matrix)
        lines += ["    <inertial>", *_origin(inertial.X_LI, "      ")]
        lines.append(f'      <mass value="{number(inertial.mass)}"/>')
        moments = {"ixx": I[0, 0], "ixy": I[0, 1], "ixz": I[0, 2], "iyy": I[1, 1], "iyz": I[1, 2], "izz": I[2, 2]}
        lines += [f"      <inertia {_attributes(moments)}/>", "    </inertial>"]
    for tag, geometries in (("visual", link.visuals), ("collision", link.collisions)):
        for geometry in geometries:
            lines += _geometry(tag, geometry, file_of)
    return [*lines, "  </link>"]


def inside_triangle(inertia: Array) -> Array:
    """`inertia` (3, 3), moved just inside the triangle inequality if rounding left it outside.

    Bullet drops the inertia of a link that violates the inequality by one bit.
    """
    principal, R = np.linalg.eigh(inertia)
    excess = principal[2] - (principal[0] + principal[1]) * (1.0 - NUDGE)
    if excess <= 0.0:
        return inertia
    principal[:2] += excess / 2.0 + NUDGE * principal[2]
    return np.asarray(R @ np.diag(principal) @ R.T)


def _geometry(tag: str, geometry: Geometry, file_of: FileOf) -> list[str]:
    lines = [f"    <{tag}>", *_origin(geometry.X_LS, "      ")]
    lines.append(f"      <geometry>{_shape(geometry.shape, file_of)}</geometry>")
    if geometry.rgba is not None:
        # PyBullet gives all materials of one name the first colour, so the name contains the colour.
        name = "rgba_" + "_".join(number(value) for value in geometry.rgba)
        lines.append(f'      <material name="{name}"><color rgba="{_numbers(geometry.rgba)}"/></material>')
    return [*lines, f"    </{tag}>"]


def _shape(shape: Shape, file_of: FileOf) -> str:
    match shape:
        case Box(size):
            return f'<box size="{_numbers(size)}"/>'
        case Sphere(radius):
            return f'<sphere radius="{number(radius)}"/>'
        case Cylinder(radius, length):
            return f'<cylinder radius="{number(radius)}" length="{number(length)}"/>'
        case Mesh(scale=scale):
            return f'<mesh filename={quoteattr(file_of(shape))} scale="{_numbers(scale)}"/>'


def _joint(joint: Joint) -> list[str]:
    lines = [f'  <joint name={quoteattr(joint.name)} type="{joint.type}">', *_origin(joint.X_PJ, "    ")]
    lines.append(f"    <parent link={quoteattr(joint.parent)}/><child link={quoteattr(joint.child)}/>")
    if joint.moves:
        lines.append(f'    <axis xyz="{_numbers(joint.axis)}"/>')
        limits = joint.limits
        lower, upper = limits.lower, limits.upper
        if joint.type != "continuous":
            lower, upper = (-UNBOUNDED if lower is None else lower), (UNBOUNDED if upper is None else upper)
        stated = {"lower": lower, "upper": upper, "velocity": limits.velocity, "effort": limits.effort}
        written = _attributes(stated)
        lines += [f"    <limit {written}/>"] if written else []
        if joint.damping or joint.friction:
            lines.append(f"    <dynamics {_attributes({'damping': joint.damping, 'friction': joint.friction})}/>")
        if limits.soft is not None:
            soft = limits.soft
            ends = {"soft_lower_limit": soft.lower, "soft_upper_limit": soft.upper}
            gains = {"k_position": soft.k_position, "k_velocity": soft.k_velocity}
            lines.append(f"    <safety_controller {_attributes(ends | gains)}/>")
        if joint.mimic is not None and joint.mimic.curve is None:  # a URDF has no closed loops
            mimic = joint.mimic
            ratio = _attributes({"multiplier": mimic.multiplier, "offset": mimic.offset})
            lines.append(f"    <mimic joint={quoteattr(mimic.joint)} {ratio}/>")
    return [*lines, "  </joint>"]


def _transmission(tag: TransmissionTag) -> list[str]:
    lines = [f"  <transmission name={quoteattr(tag.name)}>", f"    <type>transmission_interface/{tag.type}</type>"]
    for k, (name, reduction, offset) in enumerate(
        zip(tag.joints, tag.joint_reductions, tag.joint_offsets, strict=True), start=1
    ):
        numbers = f"<offset>{number(offset)}</offset><mechanicalReduction>{number(reduction)}</mechanicalReduction>"
        lines.append(f"    <joint name={quoteattr(name)}><role>joint{k}</role>{numbers}</joint>")
    for k, (name, reduction) in enumerate(zip(tag.actuators, tag.actuator_reductions, strict=True), start=1):
        numbers = f"<mechanicalReduction>{number(reduction)}</mechanicalReduction>"
        lines.append(f"    <actuator name={quoteattr(name)}><role>actuator{k}</role>{numbers}</actuator>")
    return [*lines, "  </transmission>"]
