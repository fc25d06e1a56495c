"""Shapes as coal knows them: for collision checks, hulls and mass properties alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from manipcli.model.robot import Box, Cylinder, Mesh, Shape, Sphere

if TYPE_CHECKING:
    import coal


def coal_shape(shape: Shape) -> coal.CollisionGeometry:
    """Coal's own shape; a mesh becomes the convex hull of its vertices."""
    import coal

    match shape:
        case Box(size=size):
            return coal.Box(*size)
        case Sphere(radius=radius):
            return coal.Sphere(radius)
        case Cylinder(radius=radius, length=length):
            return coal.Cylinder(radius, length)
        case Mesh(path=path, scale=scale):
            mesh = coal.MeshLoader().load(str(path), np.array(scale))
            mesh.buildConvexHull(True, "Qt")
            return mesh.convex
