"""Distances along rays in a plane to triangle surfaces: what a laser scanner measures.

The plane cuts triangles into segments; each ray ends at the nearest one. A ray through the end of a segment meets
exactly one of the segments that end there, so that none passes between two triangles. The law in Python (`_scan`) is
the definition; the kernel `scan` gives the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from manipcli.control.compiled import bind
from manipcli.core.geometry import Array
from manipcli.render.surface import Surface
from manipcli.render.triangles import Indices, Triangles

PAIRS = 1 << 18
"""Pairs of ray and segment that the law in Python treats at once."""


class Scan:
    """Rays from the origin of a frame S in its plane z = 0.

    Args:
        surfaces: each in a frame of its own.
        angles: (n) of the rays, from x towards y, increasing by equal steps [rad].
        most: what is farther away is not seen [m].
    """

    def __init__(self, surfaces: Sequence[Surface], angles: Array, most: float = np.inf) -> None:
        self._triangles = triangles = Triangles.of(surfaces)
        count = len(surfaces)
        self._most = most
        self._poses, self._shown = np.zeros((count, 12)), np.zeros(count, dtype=np.bool_)
        rays = np.column_stack([np.cos(angles), np.sin(angles)])
        self._found = np.zeros(len(angles))
        self._law = (
            *(triangles.vertices, triangles.faces, triangles.first_vertex, triangles.first_face, self._poses),
            *(self._shown, np.ascontiguousarray(angles, dtype=np.float64), rays),
            *(np.zeros_like(triangles.vertices), self._found),
        )
        self._run = bind("scan", count, *self._law)

    def distances(self, rotation: Array, position: Array) -> Array:
        """(n) distances [m], infinite where nothing is; overwritten by the next call.

        Args:
            rotation: (s, 3, 3) of each surface's frame in S.
            position: (s, 3) [m].
        """
        self._poses[:, :9] = rotation.reshape(-1, 9)
        self._poses[:, 9:] = position
        centre, radius = self._triangles.balls(rotation, position)
        near = np.sqrt(np.einsum("si,si->s", centre, centre)) - radius <= self._most
        self._shown[:] = (np.abs(centre[:, 2]) <= radius) & near
        if self._run is not None:
            self._run()
        else:
            _scan(*self._law)
        self._found[self._found > self._most] = np.inf
        return self._found


def _scan(
    vertices: Array,
    faces: Indices,
    first_vertex: Indices,
    first_face: Indices,
    poses: Array,
    shown: npt.NDArray[np.bool_],
    _angles: Array,
    rays: Array,
    _points: Array,
    distances: Array,
) -> None:
    """The law: fills `distances`."""
    distances.fill(np.inf)
    for k in np.flatnonzero(shown):
        x, y, z = vertices[first_vertex[k] : first_vertex[k + 1]].T
        R = poses[k]
        points = np.stack([((R[3 * i] * x + R[3 * i + 1] * y) + R[3 * i + 2] * z) + R[9 + i] for i in range(3)], axis=1)
        ends = _cut(points[faces[first_face[k] : first_face[k + 1]] - first_vertex[k]])
        step = max(1, PAIRS // max(len(ends), 1))
        for first in range(0, len(rays) if len(ends) else 0, step):
            part = slice(first, first + step)
            distances[part] = np.minimum(distances[part], _nearest(rays[part], ends))


def _cut(corners: Array) -> Array:
    """(m, 2, 2) the segments in which triangles (f, 3, 3) meet the plane z = 0: x and y of both ends [m]."""
    above = corners[..., 2] >= 0.0
    count = above.sum(axis=1)
    cut = np.flatnonzero((count > 0) & (count < 3))
    # The corner that is alone on its side, and the two others.
    alone = np.argmax(above[cut] == (count[cut] == 1)[:, None], axis=1)
    p = corners[cut, alone]
    ends = np.empty((len(cut), 2, 2))
    for i in range(2):
        q = corners[cut, (alone + 1 + i) % 3]
        share = p[:, 2] / (p[:, 2] - q[:, 2])
        for axis in range(2):
            ends[:, i, axis] = p[:, axis] + share * (q[:, axis] - p[:, axis])
    return ends


def _nearest(ray: Array, ends: Array) -> Array:
    """(r) distance along each ray (r, 2) to the nearest of the segments (m, 2, 2)."""
    x, y = ray[:, 0, None], ray[:, 1, None]
    one, two = (x * ends[:, i, 1] - y * ends[:, i, 0] for i in range(2))
    way = ends[:, 1] - ends[:, 0]
    across = ends[:, 0, 0] * way[:, 1] - ends[:, 0, 1] * way[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = across / (x * way[:, 1] - y * way[:, 0])
    best: Array = np.where(((one >= 0.0) != (two >= 0.0)) & (distance > 0.0), distance, np.inf).min(axis=1)
    return best
