"""Shadows on what stands still, by a picture from the light: a point is dark if something is nearer to the light.

The light is a far pinhole camera. Where it sees the points of the picture is computed once per camera of the picture;
of each state, only what moves is rendered. A point that looks away from the light is dark by its shading already.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.render.placing import Poses
from manipcli.render.raster import Fragments
from manipcli.render.shading import TO_LIGHT
from manipcli.replay.camera import Camera
from manipcli.replay.layer import FINER, Layer, Window
from manipcli.replay.lighting import shadow_loss

TEXELS = 768
"""Width and height of the picture from the light [pixel]."""
AROUND = 1.6
"""Its radius, by the radius of what the camera of the picture sees at its target."""
AWAY = 20.0
"""Distance of the light, in radii."""
MOVING_BIAS, STILL_BIAS = 0.5, 6.0
"""Least distance to what casts a shadow [texel]; larger where a surface could shade itself."""


class Shadows:
    """The shadows of one camera.

    Args:
        still: what shadows fall on.
        poses: of one state.
        camera: of the picture.
        seen: what it sees of `still`, one sample per pixel.
        size: width and height of the picture [pixel].
    """

    def __init__(self, still: Layer, poses: Poses, camera: Camera, seen: Fragments, size: tuple[int, int]) -> None:
        radius = AROUND * camera.distance * math.tan(math.radians(camera.field) / 2.0)
        eye = np.asarray(camera.target) + AWAY * radius * TO_LIGHT
        field = 2.0 * math.degrees(math.atan(1.0 / AWAY))
        self._camera = Camera(eye=(float(eye[0]), float(eye[1]), float(eye[2])), target=camera.target, field=field)
        self._whole = Window(0, 0, TEXELS, TEXELS)
        texel = 2.0 * radius / TEXELS
        self._bias = MOVING_BIAS * texel
        shape = seen.face.shape
        pixels = np.flatnonzero((seen.face >= 0) & (seen.shade > 0.0))
        lens = camera.lens((FINER * size[0], FINER * size[1]))
        row, column = np.divmod(pixels, shape[1])
        z = seen.depth.reshape(-1)[pixels]
        points = np.stack([lens.columns[::FINER][column] * z, lens.rows[::FINER][row] * z, z], axis=1)
        u, v, z = self._camera.project(camera.X_WC.apply(points), (TEXELS, TEXELS))
        u, v = u - 0.5, v - 0.5
        inside = (u >= 0.0) & (v >= 0.0) & (u < TEXELS - 1.0) & (v < TEXELS - 1.0)
        self._pixels, u, v, self._z = pixels[inside], u[inside], v[inside], z[inside]
        self._column, self._row = u.astype(np.int32), v.astype(np.int32)
        self._right, self._down = (u - self._column).astype(np.float32), (v - self._row).astype(np.float32)
        self._loss = shadow_loss(seen.shade.reshape(-1)[self._pixels]).astype(np.float32)
        every = np.arange(len(self._pixels))
        depth = still.see(poses, self._camera, self._whole).depth
        self._still = self._shaded(depth, every, STILL_BIAS * texel)
        light = np.ones(shape, dtype=np.float32)
        light.reshape(-1)[self._pixels] = 1.0 - self._loss * self._still
        self._light = light

    def light(self, moving: Layer, poses: Poses) -> npt.NDArray[np.float32]:
        """(h, w) factor of the brightness of each pixel of the picture of what is still."""
        light = self._light.copy()
        window = moving.window(poses, self._camera, self._whole)
        if window is None:
            return light
        near = (self._column >= window.left - 1) & (self._column < window.right)
        near &= (self._row >= window.top - 1) & (self._row < window.bottom)
        which = np.flatnonzero(near)
        depth = moving.see(poses, self._camera, self._whole).depth
        share = np.maximum(self._still[which], self._shaded(depth, which, self._bias))
        light.reshape(-1)[self._pixels[which]] = 1.0 - self._loss[which] * share
        return light

    def _shaded(self, depth: Array, which: npt.NDArray[np.int64], bias: float) -> npt.NDArray[np.float32]:
        """(n) share of the four texels around a point that are nearer to the light by more than `bias`."""
        first = self._row[which] * TEXELS + self._column[which]
        limit, right, down = self._z[which] - bias, self._right[which], self._down[which]
        flat = depth.reshape(-1)
        dark = [(flat[first + step] < limit).astype(np.float32) for step in (0, 1, TEXELS, TEXELS + 1)]
        upper, lower = (dark[k] + right * (dark[k + 1] - dark[k]) for k in (0, 2))
        found: npt.NDArray[np.float32] = upper + down * (lower - upper)
        return found
