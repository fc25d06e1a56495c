"""Pictures of robots and scenes, by the renderer of the cameras: no window, no GPU, reproducible bytes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, matrix_from_quat
from manipcli.model.configuration import configuration
from manipcli.model.robot import RobotModel
from manipcli.render.drawing import Drawable, Drawing, draw
from manipcli.render.placing import Placing, Poses
from manipcli.render.raster import Fragments, Raster
from manipcli.render.shading import TO_LIGHT, shaded
from manipcli.replay.camera import Camera, framing

Image = npt.NDArray[np.uint8]
"""(height, width, 3) red, green, blue; row 0 is the top."""

SKY = ((203, 213, 224), (246, 248, 250))
"""Background colours at the top and at the bottom."""
SIZE = (960, 720)
"""Default size of a picture [pixel]."""
FINER = 2
"""Factor of supersampling."""


def sky(height: int) -> Image:
    """(height, 1, 3) background of all pictures and views."""
    part = np.linspace(0.0, 1.0, height)[:, None, None]
    image: Image = ((1.0 - part) * np.array(SKY[0]) + part * np.array(SKY[1])).round().astype(np.uint8)
    return image


def png_bytes(image: Image) -> bytes:
    """The PNG file of an image."""
    from PIL import Image as PillowImage

    stream = BytesIO()
    PillowImage.fromarray(image).save(stream, "PNG", compress_level=9)
    return stream.getvalue()


def webp_bytes(image: Image, *, quality: int) -> bytes:
    """A picture as WebP; `quality` from 0 to 100."""
    from PIL import Image as PillowImage

    stream = BytesIO()
    PillowImage.fromarray(image).save(stream, "WEBP", quality=quality, method=4)
    return stream.getvalue()


class Renderer:
    """Renders a drawing; a picture is rendered at twice its size, and the average of four pixels smooths the edges.

    Args:
        drawing: the drawing.
        size: width and height of the pictures [pixel].
        still: frames that do not move between pictures of one camera; they are rendered once, and further pictures
            only where the other frames can be.
    """

    def __init__(self, drawing: Drawing, *, size: tuple[int, int] = SIZE, still: frozenset[str] = frozenset()) -> None:
        self._size = size
        shown = [each for each in drawing.layer("visual") if each.rgba[3] > 0.0 and len(each.surface.faces)]
        self._still = _Layer(drawing, [drawable for drawable in shown if drawable.frame in still])
        self._moving = _Layer(drawing, [drawable for drawable in shown if drawable.frame not in still])
        self._before: tuple[Camera, Image, Array, Image] | None = None

    def picture(self, poses: Poses, camera: Camera) -> Image:
        """The picture of one state, with the background."""
        whole = Window(0, 0, FINER * self._size[0], FINER * self._size[1])
        if self._before is None or self._before[0] != camera:
            fine = np.repeat(sky(whole.bottom), whole.right, axis=1)
            seen = self._still.see(poses, camera, whole)
            there = seen.face >= 0
            fine[there] = self._still.coloured(seen, there)
            self._before = (camera, fine, seen.depth.copy(), _averaged(fine))
        _, behind, depth, image = self._before
        image = image.copy()
        window = self._moving.window(poses, camera, whole)
        if window is None:
            return image
        part = window.slices
        seen = self._moving.see(poses, camera, whole).part(part)
        nearer = (seen.face >= 0) & (seen.depth <= depth[part])
        fine = behind[part].copy()
        fine[nearer] = self._moving.coloured(seen, nearer)
        image[window.divided(FINER).slices] = _averaged(fine)
        return image


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

    def divided(self, by: int) -> Window:
        """The window in pixels that are `by` times larger."""
        return Window(self.left // by, self.top // by, self.right // by, self.bottom // by)


class _Layer:
    """Some drawables, and their depth buffer for one camera."""

    def __init__(self, drawing: Drawing, drawables: Sequence[Drawable]) -> None:
        frames = {name: k for k, name in enumerate(drawing.frames)}
        self._surfaces = [drawable.surface for drawable in drawables]
        self._frames = np.array([frames[drawable.frame] for drawable in drawables], dtype=np.int64)
        rgb = np.array([drawable.rgba[:3] for drawable in drawables]).reshape(-1, 3)
        counts = [len(surface.faces) for surface in self._surfaces]
        self._colours = (255.0 * np.repeat(rgb, counts, axis=0)).astype(np.float32)
        self._corners = [(k, surface.corners) for k, surface in zip(self._frames.tolist(), self._surfaces, strict=True)]
        self._bound: tuple[Camera, Raster] | None = None

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
        if self._bound is None or self._bound[0] != camera:
            self._bound = camera, Raster(self._surfaces, camera.lens((whole.right, whole.bottom)), camera.near)
        X_CW = camera.X_WC.inverse()
        rotation = X_CW.R @ matrix_from_quat(poses.quat_xyzw[self._frames])
        return self._bound[1].see(rotation, X_CW.apply(poses.position[self._frames]), X_CW.R @ TO_LIGHT)

    def coloured(self, seen: Fragments, where: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
        """(n, 3) colours of the pixels in a mask."""
        return shaded(self._colours[seen.face[where]], seen.shade[where])


def _averaged(fine: Image) -> Image:
    """The average of each FINER by FINER pixels."""
    total = np.zeros((fine.shape[0] // FINER, fine.shape[1] // FINER, 3), dtype=np.uint16)
    for row in range(FINER):
        for column in range(FINER):
            total += fine[row::FINER, column::FINER]
    total += FINER * FINER // 2
    return (total // (FINER * FINER)).astype(np.uint8)


def draw_robot(robot: RobotModel, path: Path) -> tuple[str, ...]:
    """Write a PNG picture of a robot at `home`, or at zero if it has no `home`.

    Returns:
        Parts that cannot be drawn, one line each.
    """
    drawing, poses = draw(robot), Placing(robot).start(configuration(robot))
    picture = Renderer(drawing).picture(poses, framing(drawing, poses, aspect=SIZE[0] / SIZE[1]))
    path.write_bytes(png_bytes(picture))
    return drawing.missing
