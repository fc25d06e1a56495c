"""Pictures of robots and scenes with Bullet's TinyRenderer: no window, no GPU, reproducible bytes.

Bullet renders at twice the size, and the average of four pixels smooths the edges.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
import numpy.typing as npt

from manipcli.model.configuration import configuration
from manipcli.model.robot import RobotModel
from manipcli.render.drawing import Drawable, Drawing, draw
from manipcli.render.placing import Placing, Poses
from manipcli.render.surface import Surface, surface
from manipcli.replay.camera import Camera, framing
from manipcli.simulate.rasterizer import Light, Rasterizer, View

Image = npt.NDArray[np.uint8]
"""(height, width, 3) red, green, blue; row 0 is the top."""

SKY = ((203, 213, 224), (246, 248, 250))
"""Background colours at the top and at the bottom."""
SIZE = (960, 720)
"""Default size of a picture [pixel]."""
FINER = 2
"""Factor of supersampling."""
MAX_VERTICES = 60_000
"""Most vertices of one surface in Bullet; its commands hold a little more than twice as many."""


TO_LIGHT = (0.35, 0.55, 1.0)
"""Direction towards the light in the world."""
AMBIENT, DIFFUSE, SPECULAR = 0.62, 0.42, 0.08
"""Ambient, diffuse and specular brightness."""


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
    """Renders a drawing in Bullet clients. A context manager that ends the clients.

    Args:
        drawing: the drawing.
        size: width and height of the pictures [pixel].
        still: frames that do not move between pictures of one camera; they are rendered once, and further pictures
            only where the other frames can be.
    """

    def __init__(self, drawing: Drawing, *, size: tuple[int, int] = SIZE, still: frozenset[str] = frozenset()) -> None:
        self._size = size
        shown = [drawable for drawable in drawing.layer("visual") if drawable.rgba[3] > 0.0]
        self._still = _Client(drawing, [drawable for drawable in shown if drawable.frame in still])
        self._moving = _Client(drawing, [drawable for drawable in shown if drawable.frame not in still])
        self._before: tuple[Camera, _Raster, Image] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._still.close()
        self._moving.close()

    def picture(self, poses: Poses, camera: Camera) -> Image:
        """The picture of one state, with the background."""
        whole = Window(0, 0, FINER * self._size[0], FINER * self._size[1])
        if self._before is None or self._before[0] != camera:
            raster = self._still.render(poses, camera, whole, whole)
            self._before = (camera, raster, _averaged(raster.rgb))
        _, behind, image = self._before
        window = self._moving.window(poses, camera, whole)
        if window is None:
            return image.copy()
        front = self._moving.render(poses, camera, whole, window)
        rows, columns = window.slices
        nearer = front.depth <= behind.depth[rows, columns]
        rgb = np.where(nearer[..., None], front.rgb, behind.rgb[rows, columns])
        image = image.copy()
        rows, columns = window.divided(FINER).slices
        image[rows, columns] = _averaged(rgb)
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


@dataclass(frozen=True, slots=True)
class _Raster:
    """Colours (h, w, 3) and depth buffer (h, w), infinite where nothing is drawn."""

    rgb: Image
    depth: npt.NDArray[np.float32]


class _Client:
    """Some drawables in a rasterizer of their own."""

    def __init__(self, drawing: Drawing, drawables: Sequence[Drawable]) -> None:
        frames = {name: k for k, name in enumerate(drawing.frames)}
        self._raster = Rasterizer()
        self._bodies = [
            (self._add(part, drawable), frames[drawable.frame])
            for drawable in drawables
            for part in _parts(drawable.surface)
        ]
        self._corners = [
            (frames[drawable.frame], drawable.surface.corners)
            for drawable in drawables
            if len(drawable.surface.vertices)
        ]

    def close(self) -> None:
        """End the client."""
        self._raster.close()

    def _add(self, part: Surface, drawable: Drawable) -> int:
        return self._raster.add(part.vertices, part.faces, part.normals, drawable.rgba)

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

    def render(self, poses: Poses, camera: Camera, whole: Window, part: Window) -> _Raster:
        """The raster of a part of the picture."""
        for body, k in self._bodies:
            self._raster.place(body, poses.position[k], poses.quat_xyzw[k])
        up = camera.near * math.tan(math.radians(camera.field) / 2.0)
        across = up * whole.right / whole.bottom
        rgb, depth, there = self._raster.render(
            (part.right - part.left, part.bottom - part.top),
            View(
                eye=camera.eye,
                target=camera.target,
                up=camera.up,
                left=across * (2.0 * part.left / whole.right - 1.0),
                right=across * (2.0 * part.right / whole.right - 1.0),
                bottom=up * (1.0 - 2.0 * part.bottom / whole.bottom),
                top=up * (1.0 - 2.0 * part.top / whole.bottom),
                near=camera.near,
                far=camera.far,
            ),
            Light(TO_LIGHT, ambient=AMBIENT, diffuse=DIFFUSE, specular=SPECULAR),
        )
        behind = sky(whole.bottom)[part.top : part.bottom]
        return _Raster(np.where(there[..., None], rgb, behind), np.where(there, depth, np.inf))


def _averaged(fine: Image) -> Image:
    """The average of each FINER by FINER pixels."""
    total = np.zeros((fine.shape[0] // FINER, fine.shape[1] // FINER, 3), dtype=np.uint16)
    for row in range(FINER):
        for column in range(FINER):
            total += fine[row::FINER, column::FINER]
    total += FINER * FINER // 2
    return (total // (FINER * FINER)).astype(np.uint8)


def _parts(whole: Surface) -> list[Surface]:
    """A surface in pieces that fit into one Bullet command."""
    if len(whole.vertices) <= MAX_VERTICES:
        return [whole]
    parts = []
    for first in range(0, len(whole.faces), MAX_VERTICES // 3):
        used, faces = np.unique(whole.faces[first : first + MAX_VERTICES // 3], return_inverse=True)
        parts.append(surface(whole.vertices[used], faces))
    return parts


def draw_robot(robot: RobotModel, path: Path) -> tuple[str, ...]:
    """Write a PNG picture of a robot at `home`, or at zero if it has no `home`.

    Returns:
        Parts that cannot be drawn, one line each.
    """
    drawing, poses = draw(robot), Placing(robot).start(configuration(robot))
    with Renderer(drawing) as renderer:
        path.write_bytes(png_bytes(renderer.picture(poses, framing(drawing, poses, aspect=SIZE[0] / SIZE[1]))))
    return drawing.missing
