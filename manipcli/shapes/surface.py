"""Triangle surfaces: whether they are closed, the volume they enclose, and convex hulls."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.shapes.mesh import TriangleMesh

Faces = npt.NDArray[np.int64]


def welded(mesh: TriangleMesh) -> tuple[Array, Faces]:
    """Vertices (n, 3) without duplicates, and the faces between different ones: STL repeats every vertex."""
    points, index = np.unique(mesh.vertices[mesh.faces].reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3).astype(np.int64)
    proper = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[proper]
    inside_out = closed(faces) and volume(points, faces) < 0.0
    return points, faces[:, ::-1] if inside_out else faces


def closed(faces: Faces) -> bool:
    """Whether every edge has one triangle on each side, with the same orientation."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward, backward = edges[np.lexsort(edges.T)], edges[:, ::-1][np.lexsort(edges[:, ::-1].T)]
    return bool(np.array_equal(forward, backward)) and not bool((forward[1:] == forward[:-1]).all(axis=1).any())


def volume(points: Array, faces: Faces, about: Array | None = None) -> float:
    """Signed volume between the triangles and a point, by default any: a closed surface encloses the same from all."""
    a, b, c = (points[faces[:, k]] - (points[0] if about is None else about) for k in range(3))
    return float(np.einsum("ij,ij->", np.cross(a, b), c)) / 6.0


def hull(points: Array) -> tuple[Array, Faces, float] | None:
    """Corners, outward triangles and volume of the convex hull; None for points without volume.

    The corners are rounded to single precision: an engine reads them from STL, and all programs use the same.
    """
    from scipy.spatial import ConvexHull, QhullError

    rounded = np.unique(points.astype(np.float32).astype(np.float64), axis=0)
    try:
        found = ConvexHull(rounded)
    except (QhullError, ValueError):
        return None
    corners = rounded[found.vertices]
    triangles = np.searchsorted(found.vertices, found.simplices)
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward, ::-1]
    return corners, triangles.astype(np.int64), float(found.volume)
