"""Mass properties of primitive shapes and of rigid unions of them, at uniform density."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Sphere

Primitive = Box | Sphere | Cylinder


def volume(shape: Primitive) -> float:
    """Volume [m3]."""
    if isinstance(shape, Box):
        return math.prod(shape.size)
    if isinstance(shape, Sphere):
        return 4.0 / 3.0 * math.pi * shape.radius**3
    return math.pi * shape.radius**2 * shape.length


def unit_inertia(shape: Primitive) -> Array:
    """Inertia per unit mass (3, 3) [m2] about the centre of the solid shape, in its frame S.

    Box: Ixx = (y^2 + z^2) / 12 and cyclic; sphere: 2/5 r^2; cylinder: Ixx = Iyy = (3 r^2 + l^2) / 12, Izz = r^2 / 2.
    """
    if isinstance(shape, Box):
        x, y, z = shape.size
        return np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) / 12.0
    if isinstance(shape, Sphere):
        return np.eye(3) * (0.4 * shape.radius**2)
    across = (3.0 * shape.radius**2 + shape.length**2) / 12.0
    return np.diag([across, across, 0.5 * shape.radius**2])


def union(geometries: Iterable[Geometry], mass: float) -> Inertial:
    """Mass properties of disjoint primitive shapes as one rigid body of total `mass` [kg] and uniform density.

    I = sum R_i I_i R_i^T + m_i (|d_i|^2 1 - d_i d_i^T), the parallel axis theorem, with m_i in proportion to the volume
    of part i and d_i from the common centre of mass. The inertial frame I has the axes of the body's frame.
    """
    parts = [(geometry.X_LS, geometry.shape) for geometry in geometries]
    volumes = np.array([volume(_primitive(shape)) for _, shape in parts])
    masses = mass * volumes / volumes.sum()
    centres = np.array([X.p for X, _ in parts])
    centre = masses @ centres / mass
    inertia = np.zeros((3, 3))
    for (X, shape), m, p in zip(parts, masses, centres, strict=True):
        d = p - centre
        inertia += m * (X.R @ unit_inertia(_primitive(shape)) @ X.R.T + d @ d * np.eye(3) - np.outer(d, d))
    return Inertial(mass=mass, X_LI=Transform.of(xyz=centre), inertia=frozen(inertia))


def _primitive(shape: object) -> Primitive:
    if isinstance(shape, Box | Sphere | Cylinder):
        return shape
    raise TypeError(f"{type(shape).__name__} has no closed-form mass properties")
