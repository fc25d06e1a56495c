"""Depth buffer of triangle surfaces seen by a pinhole camera: exact along every ray, without window, GPU or library.

The law in Python (`_raster`) is the definition; the kernel `raster` gives the same bits. Depth is computed in double
precision per pixel from the plane of the triangle, so it has no near or far planes to lose precision between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.control.compiled import bind
from manipcli.core.geometry import Array
from manipcli.render.lens import Lens
from manipcli.render.surface import Surface
from manipcli.render.triangles import Indices, Triangles

MARGIN = 1e-6
"""Of the bounding boxes of triangles [pixel], for rounding; the edges decide."""
CHUNK = 1 << 20
"""Pairs of triangle and pixel that it treats at once."""


@dataclass(frozen=True, slots=True)
class Fragments:
    """What a camera sees; the arrays are overwritten by the next picture.

    Attributes:
        depth: (h, w) along z of the optical frame [m]; infinite where nothing is.
        face: (h, w) index of the triangle in the order of the surfaces; -1 where nothing is.
        shade: (h, w) cosine between the normal and the light; 0 where nothing is.
        slope: (h, w) cosine between the normal of the triangle and the ray, times the length of the ray at z = 1.
    """

    depth: Array
    face: Indices
    shade: Array
    slope: Array

    def part(self, of: tuple[slice, slice]) -> Fragments:
        """Some rows and columns."""
        return Fragments(self.depth[of], self.face[of], self.shade[of], self.slope[of])


class Raster:
    """Surfaces, bound once, and their depth buffer for any poses.

    Args:
        surfaces: each in a frame of its own.
        lens: of the camera.
        near: what is nearer along z is not seen [m]; positive.
    """

    def __init__(self, surfaces: Sequence[Surface], lens: Lens, near: float = 1e-3) -> None:
        count = len(surfaces)
        self._triangles = triangles = Triangles.of(surfaces)
        self.first_face = triangles.first_face
        self._lens, self._near = lens, near
        # Columns and rows of a rotation matrix and a translation per surface: of its frame in the optical frame.
        self._poses, self._lights = np.zeros((count, 12)), np.zeros((count, 3))
        self._shown = np.zeros(count, dtype=np.bool_)
        shape = lens.height, lens.width
        self._seen = Fragments(np.zeros(shape), np.zeros(shape, dtype=np.int64), np.zeros(shape), np.zeros(shape))
        settings = np.array([lens.fx, lens.fy, lens.cx, lens.cy, near, MARGIN])
        self._law = (
            *(triangles.vertices, triangles.normals, triangles.faces, triangles.first_vertex, triangles.first_face),
            *(self._poses, self._lights, self._shown, settings, lens.columns, lens.rows),
            *(
                np.zeros((len(triangles.vertices), 6)),
                self._seen.depth,
                self._seen.face,
                self._seen.shade,
                self._seen.slope,
            ),
        )
        self._run = bind("raster", count, *self._law)

    def see(self, rotation: Array, position: Array, light: Array) -> Fragments:
        """The picture of the surfaces at these poses.

        Args:
            rotation: (s, 3, 3) of each surface's frame in the optical frame.
            position: (s, 3) [m].
            light: (3,) unit vector towards the light, in the optical frame.
        """
        self._poses[:, :9] = rotation.reshape(-1, 9)
        self._poses[:, 9:] = position
        self._lights[:] = np.einsum("sij,i->sj", rotation, light)
        self._shown[:] = self._in_view(*self._triangles.balls(rotation, position))
        if self._run is not None:
            self._run()
        else:
            with np.errstate(divide="ignore", invalid="ignore"):
                _raster(*self._law)
        return self._seen

    def _in_view(self, centre: Array, radius: Array) -> npt.NDArray[np.bool_]:
        """(s) whether balls at `centre` (s, 3) in the optical frame meet the view."""
        lens, (x, y, z) = self._lens, centre.T
        found: npt.NDArray[np.bool_] = z + radius > self._near
        for across, first, last in (
            (x, (-0.5 - lens.cx) / lens.fx, (lens.width - 0.5 - lens.cx) / lens.fx),
            (y, (-0.5 - lens.cy) / lens.fy, (lens.height - 0.5 - lens.cy) / lens.fy),
        ):
            found &= across - first * z > -radius * np.hypot(1.0, first)
            found &= across - last * z < radius * np.hypot(1.0, last)
        return found


def _raster(
    vertices: Array,
    normals: Array,
    faces: Indices,
    first_vertex: Indices,
    first_face: Indices,
    poses: Array,
    lights: Array,
    shown: npt.NDArray[np.bool_],
    lens: Array,
    columns: Array,
    rows: Array,
    _points: Array,
    depth: Array,
    face: Indices,
    shade: Array,
    slope: Array,
) -> None:
    """The law: fills the last four arrays; of equally near triangles, the first one is seen."""
    fx, fy, cx, cy, near, margin = lens
    depth.fill(np.inf)
    face.fill(-1)
    shade.fill(0.0)
    slope.fill(0.0)
    of_vertex = np.repeat(np.arange(len(shown)), np.diff(first_vertex))
    R, light = poses[of_vertex], lights[of_vertex]
    x, y, z = vertices.T
    p = np.stack(
        [((R[:, 3 * i] * x + R[:, 3 * i + 1] * y) + R[:, 3 * i + 2] * z) + R[:, 9 + i] for i in range(3)], axis=1
    )
    bright = (normals[:, 0] * light[:, 0] + normals[:, 1] * light[:, 1]) + normals[:, 2] * light[:, 2]
    image = fx * (p[:, 0] / p[:, 2]) + cx, fy * (p[:, 1] / p[:, 2]) + cy

    index = np.flatnonzero(np.repeat(shown, np.diff(first_face)))
    corners = faces[index]
    ahead = (p[corners, 2] > near).sum(axis=1)
    low, high = [], []
    for across, size in zip(image, (len(columns), len(rows)), strict=True):
        of_face = across[corners]
        least, most = np.ceil(of_face.min(axis=1) - margin), np.floor(of_face.max(axis=1) + margin)
        low.append(np.where(ahead == 3, np.maximum(0.0, least), 0.0))
        high.append(np.where(ahead == 3, np.minimum(size - 1.0, most), size - 1.0))
    kept = (ahead > 0) & (low[0] <= high[0]) & (low[1] <= high[1])
    index, corners = index[kept], corners[kept]
    left, top, right, bottom = (each[kept].astype(np.int64) for each in (*low, *high))
    a, b, c = (p[corners[:, k]] for k in range(3))
    edges = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], axis=1)
    det = (a[:, 0] * edges[:, 0, 0] + a[:, 1] * edges[:, 0, 1]) + a[:, 2] * edges[:, 0, 2]
    normal = (edges[:, 0] + edges[:, 1]) + edges[:, 2]
    length = np.sqrt((normal[:, 0] * normal[:, 0] + normal[:, 1] * normal[:, 1]) + normal[:, 2] * normal[:, 2])
    wide = right - left + 1
    area = np.where(det == 0.0, 0, wide * (bottom - top + 1))

    def see(triangles: Indices) -> None:
        """The pixels in the bounding boxes of some triangles, in their order."""
        which = np.repeat(triangles, area[triangles])
        within = np.arange(len(which)) - np.repeat(np.cumsum(area[triangles]) - area[triangles], area[triangles])
        column, row = left[which] + within % wide[which], top[which] + within // wide[which]
        e, sign = edges[which], np.where(det[which] > 0.0, 1.0, -1.0)
        dx, dy = columns[column], rows[row]
        u, v, w = (sign * ((e[:, k, 0] * dx + e[:, k, 1] * dy) + e[:, k, 2]) for k in range(3))
        total = (u + v) + w
        distance = (sign * det[which]) / total
        pixel = row * len(columns) + column
        inside = (u >= 0.0) & (v >= 0.0) & (w >= 0.0) & (distance > near) & (distance < depth.reshape(-1)[pixel])
        found = np.flatnonzero(inside)
        # The nearest of each pixel; the sort is stable, so of equal ones the first.
        found = found[np.lexsort((distance[found], pixel[found]))]
        found = found[np.diff(pixel[found], prepend=-1) != 0]
        i, at = which[found], pixel[found]
        depth.reshape(-1)[at] = distance[found]
        face.reshape(-1)[at] = index[i]
        lit = (u[found] * bright[corners[i, 0]] + v[found] * bright[corners[i, 1]]) + w[found] * bright[corners[i, 2]]
        shade.reshape(-1)[at] = -sign[found] * (lit / total[found])
        slope.reshape(-1)[at] = total[found] / length[i]

    first = 0
    while first < len(area):
        last = max(first + 1, int(np.searchsorted(np.cumsum(area[first:]), CHUNK, side="right")) + first)
        see(np.arange(first, last))
        first = last


def _cross(a: Array, b: Array) -> Array:
    """(n, 3) cross products, in the order of operations of the kernel."""
    return np.stack([a[:, j] * b[:, k] - a[:, k] * b[:, j] for j, k in ((1, 2), (2, 0), (0, 1))], axis=1)
