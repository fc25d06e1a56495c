"""Drawables that are rendered together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import matrix_from_quat
from manipcli.render.drawing import Drawable, Drawing
from manipcli.render.placing import Poses
from manipcli.render.raster import Fragments, Raster
from manipcli.render.shading import TO_LIGHT
from manipcli.replay.camera import Camera
from manipcli.replay.lighting import lit

FINER = 2
"""Factor of supersampling."""


@dataclass(frozen=True, slots=True)
class Window:
    """Part of a picture [pixel]; `right` and `bottom` are exclusive."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def around(self, margin: int, whole: Window) -> Window:
        """The window with a margin on each side [pixel], within the whole picture."""
        return Window(
            max(self.left - margin, whole.left),
            max(self.top - margin, whole.top),
            min(self.right + margin, whole.right),
            min(self.bottom + margin, whole.bottom),
        )

    def divided(self, by: int) -> Window:
        """The window in pixels that are `by` times larger."""
        return Window(self.left // by, self.top // by, self.right // by, self.bottom // by)


class Layer:
    """Some drawables, and their depth buffer for one camera."""

    def __init__(self, drawing: Drawing, drawables: Sequence[Drawable]) -> None:
        frames = {name: k for k, name in enumerate(drawing.frames)}
        self._surfaces = [drawable.surface for drawable in drawables]
        self._frames = np.array([frames[drawable.frame] for drawable in drawables], dtype=np.int64)
        rgb = np.array([drawable.rgba[:3] for drawable in drawables]).reshape(-1, 3)
        counts = [len(surface.faces) for surface in self._surfaces]
        self._colours = (255.0 * np.repeat(rgb, counts, axis=0)).astype(np.float32)
        self._corners = [(k, surface.corners) for k, surface in zip(self._frames.tolist(), self._surfaces, strict=True)]
        self._rasters: dict[Camera, Raster] = {}

    def window(self, poses: Poses, camera: Camera, whole: Window) -> Window | None:
        """The part of a picture that the drawables can cover; None if they are outside it."""
        if not self._corners:
            return None
        points = np.concatenate([poses.X_WF(k).apply(corners) for k, corners in self._corners])
        x, y, depth = camera.project(points, (whole.right, whole.bottom))
        if depth.min() <= camera.near:
            return whole
        # One large pixel of margin, since a corner can be in half a pixel.
        left, right = int(x.min()) // FINER - 1, int(x.max()) // FINER + 2
        top, bottom = int(y.min()) // FINER - 1, int(y.max()) // FINER + 2
        found = Window(
            max(left * FINER, 0),
            max(top * FINER, 0),
            min(right * FINER, whole.right),
            min(bottom * FINER, whole.bottom),
        )
        return found if found.left < found.right and found.top < found.bottom else None

    def see(self, poses: Poses, camera: Camera, whole: Window) -> Fragments:
        """What the camera sees of the drawables; overwritten by the next call."""
        raster = self._rasters.get(camera)
        if raster is None:
            # Of the picture and of its shadows.
            self._rasters = dict([*self._rasters.items()][-1:])
            raster = Raster(self._surfaces, camera.lens((whole.right, whole.bottom)), camera.near)
            self._rasters[camera] = raster
        X_CW = camera.X_WC.inverse()
        rotation = X_CW.R @ matrix_from_quat(poses.quat_xyzw[self._frames])
        return raster.see(rotation, X_CW.apply(poses.position[self._frames]), X_CW.R @ TO_LIGHT)

    def coloured(self, seen: Fragments, where: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
        """(n, 3) colours of the pixels in a mask."""
        return lit(self._colours[seen.face[where]], seen.shade[where])
