"""Pictures of robots and scenes, by the renderer of the cameras: no window, no GPU, reproducible bytes."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.model.configuration import configuration
from manipcli.model.robot import RobotModel
from manipcli.render.drawing import Drawing, draw
from manipcli.render.placing import Placing, Poses
from manipcli.replay.camera import Camera, framing
from manipcli.replay.layer import FINER, Layer, Window
from manipcli.replay.shadows import Shadows

Image = npt.NDArray[np.uint8]
"""(height, width, 3) red, green, blue; row 0 is the top."""

SKY = ((203, 213, 224), (246, 248, 250))
"""Background colours at the top and at the bottom."""
SIZE = (960, 720)
"""Default size of a picture [pixel]."""


COARSE = (slice(None, None, FINER), slice(None, None, FINER))


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
        shadows: draw shadows on what is still.
    """

    def __init__(
        self,
        drawing: Drawing,
        *,
        size: tuple[int, int] = SIZE,
        still: frozenset[str] = frozenset(),
        shadows: bool = True,
    ) -> None:
        self._size = size
        shown = [each for each in drawing.layer("visual") if each.rgba[3] > 0.0 and len(each.surface.faces)]
        self._still = Layer(drawing, [drawable for drawable in shown if drawable.frame in still])
        self._moving = Layer(drawing, [drawable for drawable in shown if drawable.frame not in still])
        self._shadows = shadows
        self._before: _Still | None = None

    def picture(self, poses: Poses, camera: Camera) -> Image:
        """The picture of one state, with the background."""
        whole = Window(0, 0, FINER * self._size[0], FINER * self._size[1])
        if self._before is None or self._before.camera != camera:
            self._before = self._stand(poses, camera, whole)
        before = self._before
        image, light = before.image.copy(), None
        if before.shadows is not None:
            light = before.shadows.light(self._moving, poses)
            dark = light < 1.0
            image[dark] = (image[dark] * light[dark, None]).astype(np.uint8)
        window = self._moving.window(poses, camera, whole)
        if window is None:
            return image
        part, coarse = window.slices, window.divided(FINER).slices
        seen = self._moving.see(poses, camera, whole).part(part)
        nearer = (seen.face >= 0) & (seen.depth <= before.depth[part])
        fine = before.fine[part].copy()
        if light is not None:
            dimmed = light[coarse].repeat(FINER, axis=0).repeat(FINER, axis=1)
            dark = (dimmed < 1.0) & ~nearer
            fine[dark] = (fine[dark] * dimmed[dark, None]).astype(np.uint8)
        fine[nearer] = self._moving.coloured(seen, nearer)
        image[coarse] = _averaged(fine)
        return image

    def _stand(self, poses: Poses, camera: Camera, whole: Window) -> _Still:
        """What does not move."""
        fine = np.repeat(sky(whole.bottom), whole.right, axis=1)
        seen = self._still.see(poses, camera, whole)
        there = seen.face >= 0
        fine[there] = self._still.coloured(seen, there)
        depth = seen.depth.copy()
        shadows = Shadows(self._still, poses, camera, seen.part(COARSE), self._size) if self._shadows else None
        return _Still(camera, fine, depth, _averaged(fine), shadows)


@dataclass(frozen=True, slots=True)
class _Still:
    """The picture without what moves, at FINER times its size and averaged, its depth, and the shadows on it."""

    camera: Camera
    fine: Image
    depth: Array
    image: Image
    shadows: Shadows | None


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
