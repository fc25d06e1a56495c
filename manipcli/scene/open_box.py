"""The hollow of an open box that is made of boxes: a floor, four walls around it, and nothing in between."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.description.lint.rigid import box_about
from manipcli.scene.scene import Interior
from manipcli.shapes.primitives import Box, Geometry

ALIGNED: Final = 1e-6
"""Largest part of an edge of a box along another axis of the body."""
FLUSH: Final = 1e-4
"""[m] Smaller gaps between walls and floor are closed."""
LEAST: Final = 5e-3
"""[m] Least width and depth of a hollow."""


def open_box(geometries: Sequence[Geometry]) -> Interior | None:
    """The only hollow, open upwards (+z of O), between a box as floor and four boxes as walls; None: there is no such
    hollow, or several.

    Over the middle of a floor, the walls are the nearest boxes along x and y. They reach as high as the lowest of them.
    """
    boxes = []
    for geometry in geometries:
        about = box_about([geometry])
        if about is None:
            return None
        boxes.append((about, isinstance(geometry.shape, Box) and _aligned(geometry.X_LS.R)))
    found = [hollow for (floor, solid) in boxes if solid and (hollow := _over(floor, boxes)) is not None]
    if len(found) != 1:
        return None
    low, high = found[0]
    return Interior(X_OS=Transform.of(xyz=(low + high) / 2.0), shape=Box(tuple((high - low).tolist())))


_Corners = tuple[Array, Array]


def _aligned(R: Array) -> bool:
    """Whether the edges are along the axes of the body."""
    sizes = np.sort(np.abs(R), axis=1)
    return bool(np.all(sizes[:, 1] < ALIGNED))


def _over(floor: _Corners, boxes: Iterable[tuple[_Corners, bool]]) -> _Corners | None:
    """Corners of the hollow over a floor."""
    (low, high), boxes = floor, list(boxes)
    start = np.append((low + high)[:2] / 2.0, high[2] + 2.0 * FLUSH)
    around = [corners for corners, solid in boxes if solid and corners is not floor]
    walls: list[_Corners] = []
    least, most = start.copy(), start.copy()
    for axis in (0, 1):
        other = 1 - axis
        across = [(a, b) for a, b in around if a[other] < start[other] < b[other] and a[2] - FLUSH <= start[2] <= b[2]]
        before = [(a, b) for a, b in across if b[axis] <= start[axis]]
        after = [(a, b) for a, b in across if a[axis] >= start[axis]]
        if not before or not after:
            return None
        walls += [max(before, key=lambda wall: wall[1][axis]), min(after, key=lambda wall: wall[0][axis])]
        least[axis], most[axis] = walls[-2][1][axis], walls[-1][0][axis]
    least[2], most[2] = high[2], min(float(wall[1][2]) for wall in walls)
    covered = np.all(low[:2] <= least[:2] + FLUSH) and np.all(high[:2] >= most[:2] - FLUSH)
    closed = all(
        wall[0][1 - k // 2] <= least[1 - k // 2] + FLUSH
        and wall[1][1 - k // 2] >= most[1 - k // 2] - FLUSH
        and wall[0][2] <= least[2] + FLUSH
        for k, wall in enumerate(walls)
    )
    empty = all(
        np.any(b <= least + FLUSH)
        or np.any(a[:2] >= most[:2] - FLUSH)
        or (a[2] >= most[2] and not _covers(a, b, start))
        for (a, b), _ in boxes
    )
    return (least, most) if covered and closed and empty and np.all(most - least >= LEAST) else None


def _covers(low: Array, high: Array, point: Array) -> bool:
    """Whether a box is over a point, as the lid of a closed box is."""
    return bool(np.all(low[:2] <= point[:2]) and np.all(point[:2] <= high[:2]))
