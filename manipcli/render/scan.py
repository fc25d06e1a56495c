"""Distances along rays in a plane to triangle surfaces: what a laser scanner measures.

The plane cuts triangles into segments; each ray ends at the nearest one. A ray through the end of a segment meets
exactly one of the segments that end there, so that none passes between two triangles.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manipcli.core.geometry import Array
from manipcli.render.raster import bounding_balls
from manipcli.render.surface import Surface

PAIRS = 1 << 18
"""Pairs of ray and segment that are treated at once."""


class Scan:
    """Rays from the origin of a frame S in its plane z = 0, at `angles` (n) from x towards y [rad].

    Args:
        surfaces: each in a frame of its own.
        angles: of the rays.
        most: what is farther away is not seen [m].
    """

    def __init__(self, surfaces: Sequence[Surface], angles: Array, most: float = np.inf) -> None:
        self._corners = [each.vertices[each.faces].reshape(-1, 3) for each in surfaces]
        self._centre, self._radius = bounding_balls(surfaces)
        self._rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._most = most

    def distances(self, rotation: Array, position: Array) -> Array:
        """(n) distances [m], infinite where nothing is.

        Args:
            rotation: (s, 3, 3) of each surface's frame in S.
            position: (s, 3) [m].
        """
        found = np.full(len(self._rays), np.inf)
        centre = np.einsum("sij,sj->si", rotation, self._centre) + position
        near = (np.abs(centre[:, 2]) <= self._radius) & (np.linalg.norm(centre, axis=1) - self._radius <= self._most)
        segments = [self._cut(k, rotation[k], position[k]) for k in np.flatnonzero(near)]
        ends = np.concatenate([np.zeros((0, 2, 2)), *segments])
        if not len(ends):
            return found
        a, along = ends[:, 0], ends[:, 1] - ends[:, 0]
        step = max(1, PAIRS // len(ends))
        for first in range(0, len(found), step):
            ray = self._rays[first : first + step]
            with np.errstate(divide="ignore", invalid="ignore"):
                found[first : first + step] = _nearest(ray, ends, a, along)
        found[found > self._most] = np.inf
        return found

    def _cut(self, k: int, rotation: Array, position: Array) -> Array:
        """(m, 2, 2) the segments in which surface `k` meets the plane: x and y of both ends [m]."""
        corners = self._corners[k]
        height = (corners @ rotation[2] + position[2]).reshape(-1, 3)
        above = height >= 0.0
        count = above.sum(axis=1)
        cut = np.flatnonzero((count > 0) & (count < 3))
        if not len(cut):
            return np.zeros((0, 2, 2))
        # The corner that is alone on its side, and the two others.
        alone = np.argmax(above[cut] == (count[cut] == 1)[:, None], axis=1)
        points = (corners.reshape(-1, 3, 3)[cut] @ rotation.T + position)[..., :2]
        z = height[cut]
        row = np.arange(len(cut))
        ends = []
        for other in ((alone + 1) % 3, (alone + 2) % 3):
            share = (z[row, alone] / (z[row, alone] - z[row, other]))[:, None]
            ends.append(points[row, alone] + share * (points[row, other] - points[row, alone]))
        return np.stack(ends, axis=1)


def _nearest(ray: Array, ends: Array, a: Array, along: Array) -> Array:
    """(r) distance along each ray (r, 2) to the nearest of the segments."""
    side = ray[:, 0, None, None] * ends[..., 1] - ray[:, 1, None, None] * ends[..., 0]
    crossed = (side[..., 0] >= 0.0) != (side[..., 1] >= 0.0)
    distance = (a[:, 0] * along[:, 1] - a[:, 1] * along[:, 0]) / (
        ray[:, 0, None] * along[:, 1] - ray[:, 1, None] * along[:, 0]
    )
    best: Array = np.where(crossed & (distance > 0.0), distance, np.inf).min(axis=1)
    return best
