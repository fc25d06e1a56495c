"""Triangle surfaces with one colour, the input of viewers and renderers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.shapes.primitives import Box, Cylinder, Rgba, Sphere

Faces = npt.NDArray[np.int32]

SEGMENTS = 48
"""Segments around a cylinder or a sphere."""
MOST_SEGMENTS = 256
"""Of those that follow from a deviation."""
CREASE = math.radians(35.0)
"""Angle between triangles [rad] above which their edge is sharp; below it they are shaded as one round surface."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles in a frame of their own.

    Attributes:
        vertices: (v, 3) [m]; triangles that share a vertex are shaded as one round surface.
        faces: (f, 3) indices of vertices, counter-clockwise seen from outside.
        rgba: colour, 0 to 1; None without a colour.
    """

    vertices: Array
    faces: Faces
    rgba: Rgba | None = None

    def moved(self, X: Transform) -> Surface:
        """The surface transformed by X."""
        return replace(self, vertices=frozen(X.apply(self.vertices)))

    @property
    def normals(self) -> Array:
        """(v, 3) outward unit normals: the mean over the triangles of a vertex, weighted by area."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        weighted = np.cross(b - a, c - a)
        found = np.zeros_like(self.vertices)
        for k in range(3):
            np.add.at(found, self.faces[:, k], weighted)
        length = np.linalg.norm(found, axis=1, keepdims=True)
        return np.where(length > 0.0, found / np.where(length > 0.0, length, 1.0), (0.0, 0.0, 1.0))

    @property
    def corners(self) -> Array:
        """(8, 3) corners of its bounding box [m]; the surface must not be empty."""
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        found: Array = np.where([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)], high, low)
        return found

    def scaled(self, scale: tuple[float, float, float]) -> Surface:
        """Scaled along each axis; faces of a mirrored surface are flipped to keep their outside."""
        faces = self.faces if math.prod(scale) >= 0.0 else self.faces[:, ::-1]
        return replace(self, vertices=frozen(self.vertices * np.asarray(scale)), faces=_indices(faces))


def _indices(faces: npt.ArrayLike) -> Faces:
    array = np.array(faces, dtype=np.int32)
    array.flags.writeable = False
    return array


def surface(vertices: npt.ArrayLike, faces: npt.ArrayLike, rgba: Rgba | None = None) -> Surface:
    """A surface from array-likes; shared vertices stay shared."""
    return Surface(frozen(np.reshape(vertices, (-1, 3))), _indices(np.reshape(faces, (-1, 3))), rgba)


def joined(surfaces: Sequence[Surface]) -> Surface:
    """One surface of all triangles of several, which share no vertices; its colour is that of the first."""
    if len(surfaces) == 1:
        return surfaces[0]
    first = np.cumsum([0, *(len(each.vertices) for each in surfaces[:-1])])
    faces = np.concatenate([each.faces + k for each, k in zip(surfaces, first, strict=True)])
    return surface(np.concatenate([each.vertices for each in surfaces]), faces, surfaces[0].rgba)


def box_surface(box: Box) -> Surface:
    """A box of twelve triangles; its sides share no vertices."""
    corners = np.array([[k >> 2 & 1, k >> 1 & 1, k & 1] for k in range(8)]) - 0.5
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))]
    return smoothed(corners * np.asarray(box.size), faces)


def segments(radius: float, deviation: float | None) -> int:
    """Segments around a circle whose chords lie at most `deviation` [m] within it; `SEGMENTS` or more. Even."""
    if deviation is None or deviation >= radius:
        return SEGMENTS
    wanted = math.ceil(math.pi / math.acos(1.0 - deviation / radius))
    return min(max(SEGMENTS, wanted + wanted % 2), MOST_SEGMENTS)


def sphere_surface(sphere: Sphere, deviation: float | None = None) -> Surface:
    """A sphere of circles of latitude between two poles; chords lie at most `deviation` [m] within it."""
    count = segments(sphere.radius, deviation)
    polar = np.linspace(0.0, math.pi, count // 2 + 1)
    return _revolved(sphere.radius * np.stack([np.sin(polar), np.cos(polar)], axis=1), count)


def cylinder_surface(cylinder: Cylinder, deviation: float | None = None) -> Surface:
    """A cylinder; side and ends have separate vertices, so that the rims stay sharp."""
    radius, half = cylinder.radius, cylinder.length / 2.0
    profile = np.array([(0.0, half), (radius, half), (radius, -half), (0.0, -half)])
    return _revolved(profile, segments(radius, deviation))


def _revolved(profile: Array, count: int) -> Surface:
    """The surface of revolution of points (radius, z), from top to bottom, around the z axis."""
    around = np.arange(count) * 2.0 * math.pi / count
    circle = np.stack([np.cos(around), np.sin(around)], axis=1)
    rings = [np.column_stack([radius * circle, np.full(count, z)]) for radius, z in profile]
    k, after = np.arange(count), (np.arange(count) + 1) % count
    faces = []
    for upper in range(0, (len(profile) - 1) * count, count):
        lower = upper + count
        faces += [np.stack([upper + k, lower + k, lower + after], axis=1)]
        faces += [np.stack([upper + k, lower + after, upper + after], axis=1)]
    return smoothed(np.concatenate(rings), np.concatenate(faces))


def smoothed(vertices: npt.ArrayLike, faces: npt.ArrayLike, rgba: Rgba | None = None) -> Surface:
    """A surface whose triangles share vertices except across creases.

    Mesh files share all vertices, or none (STL), so that edges look rounded or round parts look faceted. This function
    joins the corners of triangles at one point across each edge that is not a crease.

    Args:
        vertices: (v, 3) [m].
        faces: (f, 3); triangles without an area are left out.
        rgba: colour.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    points = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
    corners = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
    if not len(corners):
        return surface(np.zeros((0, 3)), np.zeros((0, 3)), rgba)
    # One index per place: points closer than a millionth of the size are equal.
    grain = max(float(np.ptp(points, axis=0).max()), 1e-12) * 1e-6
    _, place = np.unique(np.round(points / grain), axis=0, return_inverse=True)
    place = place.reshape(-1)[corners]
    a, b, c = (points[corners[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1)
    kept = area > grain * grain
    corners, place, normals = corners[kept], place[kept], normals[kept] / area[kept, None]
    count = len(corners)
    if not count:
        return surface(np.zeros((0, 3)), np.zeros((0, 3)), rgba)

    # Every edge twice, once per triangle: (low place, high place, corner at low, corner at high).
    tail, head = place.reshape(-1), place[:, [1, 2, 0]].reshape(-1)
    at_tail, at_head = np.arange(3 * count), np.arange(3 * count).reshape(-1, 3)[:, [1, 2, 0]].reshape(-1)
    turned = tail > head
    low, high = np.where(turned, head, tail), np.where(turned, tail, head)
    at_low, at_high = np.where(turned, at_head, at_tail), np.where(turned, at_tail, at_head)
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    first, second = order[:-1][same], order[1:][same]
    smooth = np.einsum("ij,ij->i", normals[first // 3], normals[second // 3]) > math.cos(CREASE)
    first, second = first[smooth], second[smooth]
    ends = np.concatenate([at_low[first], at_high[first]]), np.concatenate([at_low[second], at_high[second]])
    graph = coo_matrix((np.ones(len(ends[0]), dtype=np.int8), ends), shape=(3 * count, 3 * count))
    number, vertex = connected_components(graph, directed=False)
    placed = np.empty((number, 3))
    placed[vertex] = points[corners.reshape(-1)]
    return surface(placed, vertex.reshape(-1, 3), rgba)
