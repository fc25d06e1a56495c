"""Shapes as coal knows them: for collision checks, hulls and mass properties alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.robot import Box, Cylinder, Mesh, Shape, Sphere

if TYPE_CHECKING:
    import coal


def coal_shape(shape: Shape) -> coal.CollisionGeometry:
    """Coal's own shape; a mesh becomes the convex hull of its vertices.

    Raises:
        ValueError: the mesh cannot be read, or its points span no volume.
    """
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
            _refuse_flat(np.array(mesh.vertices()))
            mesh.buildConvexHull(True, "Qt")
            return mesh.convex


def _refuse_flat(points: Array) -> None:
    """qhull inside coal ends the process on points without a volume, so they must not get there."""
    if len(points) < 4 or not np.all(np.isfinite(points)):
        raise ValueError("the mesh has fewer than four points, or one that is not finite")
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[2] <= 1e-9 * spread[0]:
        raise ValueError("the mesh is flat")
