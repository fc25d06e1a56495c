"""Lines and arrows over a picture, smooth at their edges, where a camera sees their points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.replay.camera import Camera

Rgb = tuple[int, int, int]
Image = npt.NDArray[np.uint8]

HEAD = 4.0
"""Length of the head of an arrow, by the width of its line; at most half of the arrow."""
BEHIND = 0.25
"""Share of its opacity that a line keeps behind something."""
TOUCHING = 0.01
"""[m] A point of a line that is less behind a surface is not hidden by it."""


def stroke(
    image: Image,
    points: Array,
    colour: Rgb,
    *,
    width: float = 2.0,
    opacity: float = 1.0,
    depth: Array | None = None,
    hidden_by: Array | None = None,
) -> None:
    """Draw a line through points (k, 2) [pixel] into a picture (h, w, 3), in place; where it crosses itself it is not
    darker.

    Args:
        image: the picture.
        points: x to the right and y down from the upper left corner; segments with a NaN are left out.
        colour: of the line.
        width: [pixel].
        opacity: 0 to 1.
        depth: (k) [m] of the points, and `hidden_by` (h, w) [m] of the picture: behind it the line is paler.
        hidden_by: see `depth`.
    """
    high, wide = image.shape[:2]
    covered = np.zeros((high, wide), dtype=np.float32)
    for k in range(len(points) - 1):
        (ax, ay), (bx, by) = points[k], points[k + 1]
        if not np.isfinite([ax, ay, bx, by]).all():
            continue
        reach = width / 2.0 + 1.0
        left, right = max(int(min(ax, bx) - reach), 0), min(int(max(ax, bx) + reach) + 1, wide)
        top, bottom = max(int(min(ay, by) - reach), 0), min(int(max(ay, by) + reach) + 1, high)
        if left >= right or top >= bottom:
            continue
        x, y = np.arange(left, right) + 0.5, np.arange(top, bottom)[:, None] + 0.5
        dx, dy = bx - ax, by - ay
        square = max(dx * dx + dy * dy, 1e-12)
        along = np.clip(((x - ax) * dx + (y - ay) * dy) / square, 0.0, 1.0)
        away = np.hypot(x - ax - along * dx, y - ay - along * dy)
        part = np.clip(width / 2.0 + 0.5 - away, 0.0, 1.0)
        if depth is not None and hidden_by is not None:
            own = depth[k] + along * (depth[k + 1] - depth[k])
            part = np.where(own > hidden_by[top:bottom, left:right] + TOUCHING, BEHIND, 1.0) * part
        np.maximum(covered[top:bottom, left:right], part, out=covered[top:bottom, left:right])
    _blend(image, covered * opacity, colour)


def arrow(image: Image, camera: Camera, start: Array, end: Array, colour: Rgb, *, width: float = 2.0) -> None:
    """Draw an arrow between two points (3,) [m] in the world into a picture, in place."""
    x, y, depth = camera.project(np.stack([start, end]), (image.shape[1], image.shape[0]))
    if depth.min() <= camera.near:
        return
    tail, tip = np.array([x[0], y[0]]), np.array([x[1], y[1]])
    length = float(np.linalg.norm(tip - tail))
    if length < 1.0:
        return
    along = (tip - tail) / length
    head = min(HEAD * width, 0.5 * length)
    neck = tip - head * along
    across = 0.45 * head * np.array([-along[1], along[0]])
    stroke(image, np.stack([tail, neck]), colour, width=width)
    _triangle(image, (tip, neck + across, neck - across), colour)


def _triangle(image: Image, corners: Sequence[Array], colour: Rgb) -> None:
    points = np.stack(corners)
    low, high = np.floor(points.min(axis=0)).astype(int) - 1, np.ceil(points.max(axis=0)).astype(int) + 1
    left, top = np.maximum(low, 0)
    right, bottom = np.minimum(high, (image.shape[1], image.shape[0]))
    if left >= right or top >= bottom:
        return
    x, y = np.arange(left, right) + 0.5, np.arange(top, bottom)[:, None] + 0.5
    inside = np.full((bottom - top, right - left), np.inf)
    (ax, ay), (bx, by) = points[1] - points[0], points[2] - points[0]
    area = ax * by - ay * bx
    for a, b in ((0, 1), (1, 2), (2, 0)):
        edge = points[b] - points[a]
        signed = (edge[0] * (y - points[a][1]) - edge[1] * (x - points[a][0])) / max(float(np.hypot(*edge)), 1e-9)
        inside = np.minimum(inside, np.sign(area) * signed)
    covered = np.zeros(image.shape[:2], dtype=np.float32)
    covered[top:bottom, left:right] = np.clip(inside + 0.5, 0.0, 1.0)
    _blend(image, covered, colour)


def _blend(image: Image, share: npt.NDArray[np.float32], colour: Rgb) -> None:
    where = share > 0.0
    part = share[where][:, None]
    image[where] = ((1.0 - part) * image[where] + part * np.array(colour)).round().astype(np.uint8)
