"""Pictures of robots and scenes with Bullet's TinyRenderer: no window, no GPU, the same bytes every time.

from manipcli.simulate.rasterizer import Light, Rasterizer, View
Bullet draws our surfaces (it reads no file) at twice the size; the average of four pixels smooths the edges.
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
from manipcli.replay.camera import Camera, framing
from manipcli.replay.drawing import Drawable, Drawing, draw
from manipcli.replay.placing import Placing, Poses
from manipcli.replay.surface import Surface, surface
from manipcli.simulate.rasterizer import Light, Rasterizer, View

Image = npt.NDArray[np.uint8]
"""(height, width, 3) red, green, blue; row 0 is the top."""

SKY = ((203, 213, 224), (246, 248, 250))
"""Colours behind everything, at the top and at the bottom."""
SIZE = (960, 720)
"""Of a picture [pixel]."""
FINER = 2
"""Rendered this many times larger."""
MAX_VERTICES = 60_000
"""Of one surface in Bullet, whose commands hold some more than twice as many."""


TO_LIGHT = (0.35, 0.55, 1.0)
"""Towards the light in the world."""
AMBIENT, DIFFUSE, SPECULAR = 0.62, 0.42, 0.08
"""How bright is what does not face the light, what faces it, and what mirrors it."""


def sky(height: int) -> Image:
    """(height, 1, 3) the background of every picture and view."""
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
    """A drawing in Bullet clients that only draw. A context manager: the clients end with it.

    Args:
        drawing: what there is.
        size: width and height of the pictures [pixel].
        still: frames that stand where they are in all pictures of one camera: they are drawn once, and of each
            picture only the part that the others may cover.
    """

    def __init__(self, drawing: Drawing, *, size: tuple[int, int] = SIZE, still: frozenset[str] = frozenset()) -> None:
        self._size = size
        shown = [one for one in drawing.layer("visual") if one.rgba[3] > 0.0]
        self._still = _Client(drawing, [one for one in shown if one.frame in still])
        self._moving = _Client(drawing, [one for one in shown if one.frame not in still])
        self._before: tuple[Camera, _Raster, Image] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._still.close()
        self._moving.close()

    def picture(self, poses: Poses, camera: Camera) -> Image:
        """What the camera sees at one instant, with the sky behind."""
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
    """Part of a picture [pixel]; `right` and `bottom` are the first column and row beyond it."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns."""
        return slice(self.top, self.bottom), slice(self.left, self.right)

    def divided(self, by: int) -> Window:
        """The same in pixels that are larger."""
        return Window(self.left // by, self.top // by, self.right // by, self.bottom // by)


@dataclass(frozen=True, slots=True)
class _Raster:
    """Colours (h, w, 3), and depth (h, w) as the graphics library counts it, infinite where nothing is."""

    rgb: Image
    depth: npt.NDArray[np.float32]


class _Client:
    """Some drawables in a rasterizer of their own."""

    def __init__(self, drawing: Drawing, drawables: Sequence[Drawable]) -> None:
        frames = {name: k for k, name in enumerate(drawing.frames)}
        self._raster = Rasterizer()
        self._bodies = [(self._add(part, one), frames[one.frame]) for one in drawables for part in _parts(one.surface)]
        self._corners = [(frames[one.frame], one.surface.corners) for one in drawables if len(one.surface.vertices)]

    def close(self) -> None:
        """Ends the client."""
        self._raster.close()

    def _add(self, part: Surface, drawable: Drawable) -> int:
        return self._raster.add(part.vertices, part.faces, part.normals, drawable.rgba)

    def window(self, poses: Poses, camera: Camera, whole: Window) -> Window | None:
        """The part of a picture that the drawables may cover; None where they are outside of it."""
        if not self._corners:
            return None
        points = np.concatenate([poses.X_WF(k).apply(corners) for k, corners in self._corners])
        x, y, depth = camera.project(points, (whole.right, whole.bottom))
        if depth.min() <= camera.near:
            return whole
        # A corner that is cut in half is none of the neighbour's: one large pixel around.
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
        """A part of the whole picture."""
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
    """FINER by FINER pixels to one."""
    total = np.zeros((fine.shape[0] // FINER, fine.shape[1] // FINER, 3), dtype=np.uint16)
    for row in range(FINER):
        for column in range(FINER):
            total += fine[row::FINER, column::FINER]
    total += FINER * FINER // 2
    return (total // (FINER * FINER)).astype(np.uint8)


def _parts(whole: Surface) -> list[Surface]:
    """A surface in pieces that fit into one command of Bullet."""
    if len(whole.vertices) <= MAX_VERTICES:
        return [whole]
    parts = []
    for first in range(0, len(whole.faces), MAX_VERTICES // 3):
        used, faces = np.unique(whole.faces[first : first + MAX_VERTICES // 3], return_inverse=True)
        parts.append(surface(whole.vertices[used], faces))
    return parts


def draw_robot(robot: RobotModel, path: Path) -> tuple[str, ...]:
    """Writes a picture of a robot at `home`, or else at zero, as a PNG file.

    Returns:
        What could not be drawn, one line each.
    """
    drawing, poses = draw(robot), Placing(robot).start(configuration(robot))
    with Renderer(drawing) as renderer:
        path.write_bytes(png_bytes(renderer.picture(poses, framing(drawing, poses, aspect=SIZE[0] / SIZE[1]))))
    return drawing.missing
