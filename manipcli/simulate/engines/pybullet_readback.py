"""Comparison of bodies and robot as loaded by Bullet with the model: Bullet drops unsupported parts silently."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from types import ModuleType
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.description.elements import Inertial
from manipcli.model.normalised_urdf import MASSLESS, inside_triangle
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body

RELATIVE: Final = 1e-4
"""Relative tolerance of masses, lengths and moments of inertia."""
ABSOLUTE: Final = 1e-9
REVOLUTE, PRISMATIC = 0, 1


def differences(p: ModuleType, client: int, body: int, robot: RobotModel, links: Mapping[int, str]) -> Iterator[str]:
    """All differences of the loaded `body` from `robot`; `links`: link names by Bullet's indices, -1 the root.

    Compares mass, centre of mass, moments of inertia and number of collision shapes of each link, and type and limits
    of each joint. The root is fixed and has no mass in Bullet.
    """
    for k, name in links.items():
        link = robot.link(name)
        shapes = len(p.getCollisionShapeData(body, k, physicsClientId=client))
        if shapes != len(link.collisions):
            yield f"link '{name}' has {shapes} collision shapes instead of {len(link.collisions)}"
        if k >= 0:
            found = _inertial(p.getDynamicsInfo(body, k, physicsClientId=client))
            yield from _unlike(name, link.inertial or MASSLESS, found)
    for k in links:
        if k >= 0:
            yield from _unlike_joint(p.getJointInfo(body, k, physicsClientId=client), robot)


def body_differences(p: ModuleType, client: int, k: int, body: Body, link: int = -1) -> Iterator[str]:
    """Shapes of the scene's `body` that link `link` of Bullet's body `k` lacks, and a different mass."""
    shapes = len(p.getCollisionShapeData(k, link, physicsClientId=client))
    if shapes < len(body.geometries):  # each part of a mesh counts
        yield f"it has {shapes} shapes instead of {len(body.geometries)}"
    mass, wanted = float(p.getDynamicsInfo(k, link, physicsClientId=client)[0]), 0.0 if body.fixed else body.mass
    if not abs(mass - wanted) <= ABSOLUTE + RELATIVE * wanted:
        yield f"it has a mass of {mass:g} kg instead of {wanted:g} kg"


# PyBullet's tuples are untyped; their order is that of its manual, and a mistake ends in an error here.


def _inertial(info: tuple[object, ...]) -> Inertial:
    mass, moments, p, quat = info[0], info[2], info[3], info[4]
    X_LI = Transform.of(xyz=p, quat_xyzw=quat)  # type: ignore[arg-type]
    return Inertial(mass=float(mass), X_LI=X_LI, inertia=np.diag(np.asarray(moments, dtype=float)))  # type: ignore[arg-type]


def _unlike(name: str, wanted: Inertial, found: Inertial) -> Iterator[str]:
    if not abs(found.mass - wanted.mass) <= ABSOLUTE + RELATIVE * wanted.mass:
        yield f"link '{name}' has a mass of {found.mass:g} kg instead of {wanted.mass:g} kg"
    elif wanted.mass == 0.0:
        return
    if not np.allclose(found.X_LI.p, wanted.X_LI.p, rtol=RELATIVE, atol=1e-6):
        yield f"link '{name}' has its centre of mass at {found.X_LI.p} m instead of {wanted.X_LI.p} m"
    want = _in_link(dataclasses.replace(wanted, inertia=inside_triangle(wanted.inertia)))
    if not np.allclose(_in_link(found), want, rtol=0.0, atol=ABSOLUTE + RELATIVE * float(np.abs(want).max())):
        yield f"link '{name}' has other moments of inertia: {np.diag(_in_link(found))} instead of {np.diag(want)} kg m2"


def _in_link(inertial: Inertial) -> Array:
    """(3, 3) about the centre of mass, along the axes of the link."""
    R = inertial.X_LI.R
    return np.asarray(R @ inertial.inertia @ R.T)


def _unlike_joint(info: tuple[object, ...], robot: RobotModel) -> Iterator[str]:
    name = bytes(info[1]).decode()  # type: ignore[call-overload]
    joint = robot.joint(name)
    if not joint.moves:
        return
    if info[2] != (PRISMATIC if joint.type == "prismatic" else REVOLUTE):
        yield f"joint '{name}' is of Bullet's type {info[2]}"
    lower, upper, effort, velocity = (float(v) for v in info[8:12])  # type: ignore[arg-type]
    limits = joint.limits
    for word, found, wanted in (
        ("lower limit", lower, limits.lower),
        ("upper limit", upper, limits.upper),
        ("effort limit", effort, limits.effort),
        ("velocity limit", velocity, limits.velocity),
    ):
        if wanted is not None and not np.isclose(found, wanted, rtol=RELATIVE):
            yield f"joint '{name}' has a {word} of {found:g} instead of {wanted:g}"
