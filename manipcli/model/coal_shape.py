"""Shapes as coal knows them: for collision checks, hulls and mass properties alike."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.mesh import read_mesh
from manipcli.model.mesh_formats import UnusableMesh
from manipcli.model.robot import Box, Cylinder, Mesh, Shape, Sphere

if TYPE_CHECKING:
    import coal


def coal_shape(shape: Shape) -> coal.CollisionGeometry:
    """Coal's own shape; a mesh becomes the convex hull of the vertices of its triangles.

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
        case Mesh(uri=uri, path=path, scale=scale):
            try:
                mesh = read_mesh(path)
            except UnusableMesh as error:
                raise ValueError(f"mesh '{uri}' {error.reason}") from error
            if mesh.flat:  # qhull inside coal ends the process on points without a volume
                raise ValueError(f"mesh '{uri}' is flat")
            return _hull(mesh.vertices[np.unique(mesh.faces)] * np.array(scale))


def _hull(points: Array) -> coal.CollisionGeometry:
    import coal

    model = coal.BVHModelOBBRSS()
    model.beginModel(0, len(points))
    model.addVertices(points)
    model.buildConvexHull(True, "Qt")
    return model.convex
