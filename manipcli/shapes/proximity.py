"""Convex shapes, distances and contacts between them, computed by coal; no other module imports coal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.shapes.mesh import read_mesh
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Box, Cylinder, Mesh, Shape, Sphere

if TYPE_CHECKING:
    import coal
    from coal import CollisionGeometry as CollisionGeometry


@dataclass(frozen=True, slots=True)
class Proximity:
    """Distance between two shapes A and B, in world coordinates.

    Attributes:
        distance: [m]; negative for an overlap.
        point: (3,) [m] midpoint of their nearest points.
        normal: (3,) from A to B; not finite if undefined.
    """

    distance: float
    point: Array
    normal: Array


def coal_shape(shape: Shape) -> CollisionGeometry:
    """The shape for coal; a mesh, or its part, becomes its convex hull.

    Raises:
        ValueError: the mesh cannot be read, or is flat.
    """
    import coal

    match shape:
        case Box(size=size):
            return coal.Box(*size)
        case Sphere(radius=radius):
            return coal.Sphere(radius)
        case Cylinder(radius=radius, length=length):
            return coal.Cylinder(radius, length)
        case Mesh(part=part, scale=scale) if part is not None:
            return _hull(np.array(part.points) * np.array(scale))
        case Mesh(uri=uri, path=path, scale=scale):
            try:
                mesh = read_mesh(path)
            except UnusableMesh as error:
                raise ValueError(f"mesh '{uri}' {error.reason}") from error
            if mesh.flat:  # qhull inside coal terminates the process on points without volume
                raise ValueError(f"mesh '{uri}' is flat")
            return _hull(mesh.vertices[np.unique(mesh.faces)] * np.array(scale))


def _hull(points: Array) -> CollisionGeometry:
    import coal

    model = coal.BVHModelOBBRSS()
    model.beginModel(0, len(points))
    model.addVertices(points)
    model.buildConvexHull(True, "Qt")
    return model.convex


def surface(shape: Shape, *, most_triangles: int) -> CollisionGeometry | None:
    """The triangles of a mesh instead of its hull; None for a mesh with more than `most_triangles`."""
    import coal

    if not isinstance(shape, Mesh) or shape.part is not None:
        return coal_shape(shape)
    mesh = read_mesh(shape.path)
    if len(mesh.faces) > most_triangles:
        return None
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    points = coal.StdVec_Vec3s()
    points.extend(list(mesh.vertices * np.array(shape.scale)))
    triangles = coal.StdVec_Triangle()
    triangles.extend([coal.Triangle(*row) for row in mesh.faces.tolist()])
    model.addSubModel(points, triangles)
    model.endModel()
    return model


def bounding_ball(shape: CollisionGeometry) -> tuple[Array, float]:
    """Centre (3,) and radius [m] of a ball around a shape, in its frame."""
    shape.computeLocalAABB()
    return np.array(shape.aabb_center), float(shape.aabb_radius)


def distance(a: CollisionGeometry, X_WA: Transform, b: CollisionGeometry, X_WB: Transform) -> Proximity:
    """Distance, midpoint and normal between two shapes."""
    import coal

    result = coal.DistanceResult()
    coal.distance(a, _placed(X_WA), b, _placed(X_WB), coal.DistanceRequest(), result)
    point = (result.getNearestPoint1() + result.getNearestPoint2()) / 2.0
    return Proximity(float(result.min_distance), point, np.array(result.normal))


def overlap(a: CollisionGeometry, X_WA: Transform, b: CollisionGeometry, X_WB: Transform) -> bool:
    """Whether two shapes touch or overlap."""
    import coal

    result = coal.CollisionResult()
    coal.collide(a, _placed(X_WA), b, _placed(X_WB), coal.CollisionRequest(), result)
    return bool(result.isCollision())


def _placed(X: Transform) -> coal.Transform3s:
    import coal

    return coal.Transform3s(np.array(X.R), np.array(X.p))
