"""Volume, centre and inertia of the shapes of a link as one solid of uniform density."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.scene.mass_properties import Primitive, unit_inertia, volume
from manipcli.shapes.mesh import TriangleMesh, read_mesh
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Shape, Sphere
from manipcli.shapes.surface import Faces, hull, welded

SAMPLES: Final = 24
"""Points per axis in a primitive that overlaps another: the volume of their union is then within 1 %."""
WELD: Final = 1e-6
"""Vertices nearer than this share of the mesh's size are one: exporters write them with 6 digits."""
LEAST_SHARE: Final = 0.01
"""A closed mesh with a smaller share of its hull's volume is a sheet without thickness, and counts as its hull."""


@dataclass(frozen=True, slots=True)
class Solid:
    """A solid body, in the frame of its shapes.

    Attributes:
        volume: [m3].
        centre: (3,) [m] centre of volume.
        second: (3, 3) [m5] integral of (x - centre) (x - centre)^T over the volume.
        by: what was measured: "closed mesh", "convex hull of a mesh", "primitives".
    """

    volume: float
    centre: Array
    second: Array
    by: tuple[str, ...]

    @property
    def inertia(self) -> Array:
        """(3, 3) [m5] about the centre, for a density of 1 kg/m3: I = tr(S) 1 - S, with S the second moment."""
        return np.asarray(np.trace(self.second) * np.eye(3) - self.second)


def solid(geometries: Sequence[Geometry]) -> Solid | None:
    """The shapes as one solid; None without a shape that has a volume.

    Primitives by closed form; where some overlap, each point of `SAMPLES`^3 counts by the number of primitives around
    it. A mesh by the tetrahedra between its triangles and a point, if it is closed; else its convex hull. Overlaps with
    meshes count twice.
    """
    primitives = [each for each in geometries if not isinstance(each.shape, Mesh)]
    parts = [_primitive(each, [other for other in primitives if other is not each]) for each in primitives]
    for each in geometries:
        if isinstance(each.shape, Mesh) and (found := mesh_solid(each.shape)) is not None:
            centre, second = each.X_LS.apply(found.centre), each.X_LS.R @ found.second @ each.X_LS.R.T
            parts.append(Solid(found.volume, centre, second, found.by))
    return _joined(parts) if parts else None


def _joined(parts: Sequence[Solid]) -> Solid:
    """Disjoint solids as one: the parallel axis theorem."""
    volumes = np.array([part.volume for part in parts])
    centre = volumes @ np.array([part.centre for part in parts]) / volumes.sum()
    second = np.zeros((3, 3))
    for part in parts:
        d = part.centre - centre
        second += part.second + part.volume * np.outer(d, d)
    return Solid(float(volumes.sum()), centre, second, tuple(sorted({word for part in parts for word in part.by})))


def _primitive(geometry: Geometry, others: Sequence[Geometry]) -> Solid:
    """The share of a primitive that belongs to it; what it has in common with others is divided among them."""
    shape, X = geometry.shape, geometry.X_LS
    assert not isinstance(shape, Mesh)
    whole = volume(shape)
    inertia = unit_inertia(shape)
    second = whole * (np.trace(inertia) / 2.0 * np.eye(3) - inertia)
    near = [other for other in others if np.linalg.norm(other.X_LS.p - X.p) < _radius(other.shape) + _radius(shape)]
    points = X.apply(_points(shape)) if near else np.empty((0, 3))
    around = np.ones(len(points))
    for other in near:
        around += _inside(other, points)
    if not (around > 1.0).any():
        return Solid(whole, X.p, X.R @ second @ X.R.T, ("primitives",))
    weights = 1.0 / around / len(points)
    share = weights.sum()
    centre = weights @ points / share
    away = points - centre
    return Solid(whole * share, centre, whole * (away.T * weights) @ away, ("primitives",))


def _points(shape: Primitive) -> Array:
    """(SAMPLES^3, 3) points in a primitive, each for the same volume."""
    middles = (np.arange(SAMPLES) + 0.5) / SAMPLES
    u, v, w = (axis.ravel() for axis in np.meshgrid(middles, middles, middles, indexing="ij"))
    if isinstance(shape, Box):
        return np.asarray(np.stack([u - 0.5, v - 0.5, w - 0.5], axis=1) * np.array(shape.size))
    angle = 2.0 * np.pi * v
    if isinstance(shape, Cylinder):
        across, height = shape.radius * np.sqrt(u), shape.length * (w - 0.5)
    else:
        r = shape.radius * np.cbrt(u)
        height = r * (2.0 * w - 1.0)
        across = np.sqrt(r * r - height * height)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)


def _inside(geometry: Geometry, points: Array) -> Array:
    """Whether each point (n, 3) is in a primitive."""
    local = geometry.X_LS.inverse().apply(points)
    shape = geometry.shape
    if isinstance(shape, Box):
        return np.asarray((np.abs(local) < np.array(shape.size) / 2.0).all(axis=1), dtype=np.float64)
    if isinstance(shape, Sphere):
        return np.asarray((local**2).sum(axis=1) < shape.radius**2, dtype=np.float64)
    assert isinstance(shape, Cylinder)
    flat = (local[:, :2] ** 2).sum(axis=1) < shape.radius**2
    return np.asarray(flat & (np.abs(local[:, 2]) < shape.length / 2.0), dtype=np.float64)


def _radius(shape: Shape) -> float:
    """Of the ball around a primitive [m]."""
    if isinstance(shape, Box):
        return float(np.linalg.norm(shape.size)) / 2.0
    if isinstance(shape, Cylinder):
        return float(np.hypot(shape.radius, shape.length / 2.0))
    assert isinstance(shape, Sphere)
    return float(shape.radius)


def mesh_solid(mesh: Mesh) -> Solid | None:
    """The solid of a scaled mesh, or of its part, in its own frame; None if it has no volume or cannot be read."""
    if mesh.part is not None:
        points, faces = np.array(mesh.part.points), np.array(mesh.part.triangles, dtype=np.int64)
        return _tetrahedra(points * np.array(mesh.scale), faces, "convex part of a mesh")
    try:
        return _of_file(read_mesh(mesh.path), mesh.scale)
    except UnusableMesh:
        return None


@functools.lru_cache(maxsize=64)
def _of_file(mesh: TriangleMesh, scale: tuple[float, float, float]) -> Solid | None:
    """Cached: the reader returns the same mesh object while the file does not change."""
    points, faces = welded(mesh)
    points = points * np.array(scale)
    convex = hull(points)
    if convex is None or convex[2] <= 0.0:
        return None
    merged = _merged(points, faces)
    if _encloses(merged):
        found = _tetrahedra(points, merged, "closed mesh")
        if found is not None and LEAST_SHARE * convex[2] < found.volume <= convex[2] * (1.0 + LEAST_SHARE):
            return found
    return _tetrahedra(convex[0], convex[1], "convex hull of a mesh")


def _merged(points: Array, faces: Faces) -> Faces:
    """The faces between vertices that are apart by more than rounding; of nearly equal ones the first."""
    grid = np.round((points - points.min(axis=0)) / (WELD * float(np.ptp(points, axis=0).max())))
    _, first, index = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    merged = first[index.ravel()][faces]
    apart = (merged[:, 0] != merged[:, 1]) & (merged[:, 1] != merged[:, 2]) & (merged[:, 2] != merged[:, 0])
    return np.asarray(merged[apart], dtype=np.int64)


def _encloses(faces: Faces) -> bool:
    """Whether each edge is passed as often in one direction as in the other, so that the surface has no border."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    back = edges[:, ::-1]
    return len(faces) > 3 and np.array_equal(edges[np.lexsort(edges.T)], back[np.lexsort(back.T)])


def _tetrahedra(points: Array, faces: Faces, by: str) -> Solid | None:
    """The solid between the triangles: the sum of the tetrahedra with the middle, signed by their orientation.

    A tetrahedron with a corner at the origin and the others a, b, c has the volume V = a . (b x c) / 6, the centre
    (a + b + c) / 4 and the second moment V / 20 (s s^T + a a^T + b b^T + c c^T) with s = a + b + c.
    """
    middle = points.mean(axis=0)
    a, b, c = (points[faces[:, k]] - middle for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    total = float(volumes.sum())
    if total == 0.0 or not np.isfinite(total):
        return None
    s = a + b + c
    centre = volumes @ s / 4.0 / total
    second = sum(np.einsum("i,ij,ik->jk", volumes, x, x) for x in (s, a, b, c)) / 20.0 / np.sign(total)
    second = np.asarray(second - abs(total) * np.outer(centre, centre))
    return Solid(abs(total), middle + centre, second, (by,))
