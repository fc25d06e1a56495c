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
from manipcli.render.drawing import Drawing, draw, ground_height
from manipcli.render.placing import Placing, Poses
from manipcli.render.raster import Fragments
from manipcli.render.shading import TO_LIGHT
from manipcli.replay.camera import Camera, framing
from manipcli.replay.ground import see_ground
from manipcli.replay.layer import FINER, Layer, Window
from manipcli.replay.outlines import REACH, outline_light
from manipcli.replay.shadows import Shadows

Image = npt.NDArray[np.uint8]
"""(height, width, 3) red, green, blue; row 0 is the top."""

SKY = ((203, 213, 224), (246, 248, 250))
"""Background colours at the top and at the bottom."""
SIZE = (960, 720)
"""Default size of a picture [pixel]."""

GHOST, APART = 0.5, 2e-3
"""Opacity of a ghost, and the distance [m] by which it must be before the rest to be seen."""
GROUND = np.iinfo(np.int32).max
"""Index of the ground among the triangles."""
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
        ground: height of the ground [m]; None without one.
        hidden: frames that are not drawn, such as the floor that the ground replaces.
    """

    def __init__(
        self,
        drawing: Drawing,
        *,
        size: tuple[int, int] = SIZE,
        still: frozenset[str] = frozenset(),
        shadows: bool = True,
        ground: float | None = None,
        hidden: frozenset[str] = frozenset(),
    ) -> None:
        self._size = size
        shown = [
            each
            for each in drawing.layer("visual")
            if each.rgba[3] > 0.0 and len(each.surface.faces) and each.frame not in hidden
        ]
        self._still = Layer(drawing, [drawable for drawable in shown if drawable.frame in still])
        self._moving = Layer(drawing, [drawable for drawable in shown if drawable.frame not in still])
        self._shadows, self._ground = shadows, ground
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
        seen = self._moving.see(poses, camera, whole)
        around = window.around(REACH, whole)
        depth = np.minimum(before.depth[around.slices], seen.depth[around.slices])
        seen = seen.part(part)
        nearer = (seen.face >= 0) & (seen.depth <= before.depth[part])
        fine = before.fine[part].copy()
        if light is not None:
            dimmed = light[coarse].repeat(FINER, axis=0).repeat(FINER, axis=1)
            dark = (dimmed < 1.0) & ~nearer
            fine[dark] = (fine[dark] * dimmed[dark, None]).astype(np.uint8)
        fine[nearer] = self._moving.coloured(seen, nearer)
        top, left = window.top - around.top, window.left - around.left
        _darken(fine, outline_light(depth)[top : top + fine.shape[0], left : left + fine.shape[1]])
        image[coarse] = _averaged(fine)
        return image

    def with_ghost(self, poses: Poses, ghost: Poses, camera: Camera, tint: tuple[int, int, int]) -> tuple[Image, Array]:
        """The picture of one state with what moves also where it is in another, translucent; and its depth (h, w) [m],
        infinite where nothing is."""
        image = self.picture(poses, camera)
        assert self._before is not None  # it has just been drawn
        whole = Window(0, 0, FINER * self._size[0], FINER * self._size[1])
        depth = np.minimum(self._before.depth, self._moving.see(poses, camera, whole).depth)
        seen = self._moving.see(ghost, camera, whole)
        there = (seen.face >= 0) & (seen.depth < depth - APART)
        share = np.where(there, GHOST, 0.0).astype(np.float32)
        colour = np.zeros((*there.shape, 3), dtype=np.float32)
        colour[there] = 0.5 * (self._moving.coloured(seen, there) + np.array(tint, dtype=np.float32))
        _darken(colour, outline_light(np.where(there, seen.depth, np.inf)))
        fine = image.repeat(FINER, axis=0).repeat(FINER, axis=1)
        blended = (1.0 - share[..., None]) * fine + share[..., None] * colour
        return _averaged(blended.round().astype(np.uint8)), depth[COARSE]

    def _stand(self, poses: Poses, camera: Camera, whole: Window) -> _Still:
        """What does not move."""
        size = whole.right, whole.bottom
        fine = np.repeat(sky(whole.bottom), whole.right, axis=1)
        seen = self._still.see(poses, camera, whole)
        there = seen.face >= 0
        ground = None if self._ground is None else see_ground(self._ground, camera, size)
        if ground is not None:
            on_ground = np.isfinite(ground.depth) & ~(seen.depth < ground.depth)
            there &= ~on_ground
            share = ground.share[on_ground][:, None]
            fine[on_ground] = ((1.0 - share) * fine[on_ground] + share * ground.colour[on_ground]).astype(np.uint8)
            seen = Fragments(
                np.where(on_ground, ground.depth, seen.depth),
                np.where(on_ground, GROUND, seen.face),
                np.where(on_ground, TO_LIGHT[2], seen.shade),
                seen.slope,
            )
        fine[there] = self._still.coloured(seen, there)
        depth = seen.depth.copy()
        shadows = Shadows(self._still, poses, camera, seen.part(COARSE), self._size) if self._shadows else None
        outlined = fine.copy()
        _darken(outlined, outline_light(depth))
        return _Still(camera, fine, depth, _averaged(outlined), shadows)


@dataclass(frozen=True, slots=True)
class _Still:
    """The picture without what moves: at FINER times its size without outlines, its depth, its average with outlines,
    and the shadows on it."""

    camera: Camera
    fine: Image
    depth: Array
    image: Image
    shadows: Shadows | None


def _darken(fine: Image | npt.NDArray[np.float32], light: npt.NDArray[np.float32]) -> None:
    """Multiply a picture by a factor of the brightness, in place."""
    dark = light < 1.0
    fine[dark] = (fine[dark] * light[dark, None]).astype(fine.dtype)


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
    ground = ground_height(drawing, poses, frozenset())
    picture = Renderer(drawing, ground=ground).picture(poses, framing(drawing, poses, aspect=SIZE[0] / SIZE[1]))
    path.write_bytes(png_bytes(picture))
    return drawing.missing
