"""The part of a depth picture that can show a body: what is nearer there than everything that was expected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, Transform
from manipcli.render.lens import Lens

Mask = npt.NDArray[np.bool_]

NEARER = 4.0
"""Standard deviations by which a pixel is nearer than expected to count as something that was not expected."""
LEAST_NOISE = 1e-4
"""Of depth [m]: rounding and tessellation."""
NOTHING = 1e3
"""Depth where nothing is [m]."""
NEIGHBOURS = 5
"""Least number of such pixels among 3 x 3; fewer are noise."""
BORDER = 6
"""Pixels around a part, for the blur of edges."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A part of a picture, every `stride`-th pixel.

    Attributes:
        lens: of these pixels.
        X_WC: optical frame in the world.
        rays: (h, w, 3) of the pixels in C, at z = 1.
        depth: (h, w) measured [m]; NaN: not measured, NOTHING: neither measured nor expected.
        noise: (h, w) its standard deviation [m].
        expected: (h, w) depth without the body [m]; NOTHING where nothing is.
        floor: (h, w) depth [m] beyond which a pixel is not different from what was expected.
        shown: (h, w) where something unexpected is.
        near: (h, w) where it is in the volume that the body can be in.
        pixel: (2,) size of a pixel of the camera at z = 1.
    """

    lens: Lens
    X_WC: Transform
    rays: Array
    depth: Array
    noise: Array
    expected: Array
    floor: Array
    shown: Mask
    near: Mask
    pixel: Array

    def some(self, rows: slice, columns: slice) -> Picture:
        """The picture of these pixels: `start` and `step` of the slices must be given."""
        at = (rows, columns)
        depth, old = self.depth[at], self.lens
        cx, cy = (old.cx - columns.start) / columns.step, (old.cy - rows.start) / rows.step
        lens = Lens(depth.shape[1], depth.shape[0], old.fx / columns.step, old.fy / rows.step, cx, cy)
        arrays = (self.noise[at], self.expected[at], self.floor[at], self.shown[at], self.near[at])
        return Picture(lens, self.X_WC, self.rays[at], depth, *arrays, self.pixel)

    def strided(self, most: int) -> Picture:
        """Every n-th pixel, with the least n for which no side has more than `most`."""
        step = -(-max(self.depth.shape) // most)
        return self.some(slice(0, None, step), slice(0, None, step))

    def around(self, points: Array) -> Picture:
        """The part that shows what is unexpected and near, and points (n, 3) in the world."""
        seen = np.argwhere(self.near)
        first, last = seen.min(axis=0), seen.max(axis=0)
        inside = window(self.lens, self.X_WC.inverse().apply(points))
        if inside is not None:
            first = np.minimum(first, [each.start for each in inside])
            last = np.maximum(last, [each.stop for each in inside])
        first = np.maximum(first - BORDER, 0)
        rows, columns = (slice(int(a), int(b) + BORDER, 1) for a, b in zip(first, last, strict=True))
        return self.some(rows, columns)

    def cloud(self) -> Array:
        """(n, 3) points in the world of what is near."""
        return self.X_WC.apply(self.rays[self.near] * self.depth[self.near][:, None])


def cut(
    lens: Lens, X_WC: Transform, depth: Array, noise: Array | float, expected: Array, low: Array, high: Array
) -> Picture | None:
    """The part of a picture that can show a volume between the corners `low` and `high` (3,) [m] in the world.

    None if the volume is not in the picture.
    """
    from scipy.ndimage import minimum_filter

    inside = window(lens, X_WC.inverse().apply(corners(low, high)))
    if inside is None:
        return None
    rows, columns = inside
    z = np.array(depth[inside], dtype=np.float64)
    sigma = np.broadcast_to(np.asarray(noise, dtype=np.float64), depth.shape)[inside]
    sigma = np.maximum(np.where(np.isfinite(sigma), sigma, LEAST_NOISE), LEAST_NOISE)
    behind = np.minimum(np.asarray(expected[inside], dtype=np.float64), NOTHING)
    z[~(z > 0.0) | ~np.isfinite(z)] = np.nan
    z[np.isnan(z) & (behind == NOTHING)] = NOTHING
    part = Lens(z.shape[1], z.shape[0], lens.fx, lens.fy, lens.cx - columns.start, lens.cy - rows.start)
    rays = np.asarray(part.points(np.ones_like(z)), dtype=np.float64)
    # A pixel may show what its neighbours were expected to show.
    floor = minimum_filter(behind, size=3, mode="nearest") - NEARER * sigma
    with np.errstate(invalid="ignore"):
        shown = z < floor
    shown = patches(shown)
    points = X_WC.apply(rays * np.where(shown, z, 0.0)[..., None])
    near = shown & ((points >= low) & (points <= high)).all(axis=-1)
    pixel = np.array([1.0 / lens.fx, 1.0 / lens.fy])
    return Picture(part, X_WC, rays, z, sigma, behind, floor, shown, near, pixel)


def corners(low: Array, high: Array) -> Array:
    """(8, 3) of a box between two of them."""
    found: Array = np.where([[k & 1, k >> 1 & 1, k >> 2 & 1] for k in range(8)], high, low)
    return found


def window(lens: Lens, points: Array) -> tuple[slice, slice] | None:
    """Rows and columns that can show the convex hull of points (n, 3) in C; None without any."""
    if points[:, 2].max() <= 0.0:
        return None
    first, last = np.zeros(2, dtype=np.int64), np.array([lens.width, lens.height])
    if points[:, 2].min() > 1e-3:
        image = np.clip(lens.project(points), -1e6, 1e6)
        first = np.maximum(first, np.floor(image.min(axis=0)).astype(np.int64) - 2)
        last = np.minimum(last, np.ceil(image.max(axis=0)).astype(np.int64) + 3)
    if (first >= last).any():
        return None
    return slice(int(first[1]), int(last[1])), slice(int(first[0]), int(last[0]))


def patches(mask: Mask) -> Mask:
    """The pixels (h, w) of a mask with at least NEIGHBOURS of it among the 3 x 3 about them."""
    from scipy.ndimage import uniform_filter

    found: Mask = mask & (uniform_filter(mask.astype(np.float32), size=3, mode="nearest") * 9.0 > NEIGHBOURS - 0.5)
    return found
