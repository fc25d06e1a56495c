"""Contact forces over a picture: an arrow at each contact point, a number for each pair of parts, and a scale."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.replay.camera import Camera
from manipcli.replay.caption import INK, PAPER, font, text_size
from manipcli.replay.forces import LEAST, LONGEST, Forces, Push
from manipcli.replay.renderer import Image
from manipcli.replay.strokes import Rgb, arrow, stroke

NORMAL: Final[Rgb] = (204, 32, 32)
FRICTION: Final[Rgb] = (226, 122, 0)
"""Colours of the arrows, those of the page."""
NUMBERED: Final = 6
"""Most pairs of parts with a number: those with the largest forces."""
ROUND: Final = 1.0, 2.0, 5.0
"""Forces of the scale, times a power of ten."""


def draw_forces(image: Image, camera: Camera, forces: Forces, k: int) -> Image:
    """The picture with the contact forces at the k-th time; unchanged without any."""
    contacts = [pushes for _, pushes in forces.by_contact(k)]
    if not contacts:
        return image
    drawn = image.copy()
    width = max(image.shape[0] / 300.0, 1.2)
    for pushes in contacts:
        for push in pushes:
            for force, colour in ((push.normal, NORMAL), (push.friction, FRICTION)):
                arrow(drawn, camera, push.point, tip(push.point, force, forces.scale), colour, width=width)
    return _written(drawn, camera, forces.scale, contacts)


def tip(point: Array, force: Array, scale: float) -> Array:
    """The end (3,) [m] of the arrow of a force (3,) [N] at a point, at `scale` [m/N] and at most `LONGEST`."""
    strength = float(np.linalg.norm(force))
    return point + (force * min(scale, LONGEST / strength) if strength > 0.0 else 0.0 * force)


def _written(image: Image, camera: Camera, scale: float, contacts: list[tuple[Push, ...]]) -> Image:
    """The numbers of the strongest pairs, and the scale at the lower left."""
    from PIL import Image as PillowImage
    from PIL import ImageDraw

    canvas = PillowImage.fromarray(image)
    pen = ImageDraw.Draw(canvas)
    size = max(round(0.75 * text_size(canvas.height)), 9)
    letters = font(size)
    net = [(float(np.linalg.norm(sum(push.normal + push.friction for push in pushes))), pushes) for pushes in contacts]
    rows: list[tuple[float, float, str]] = []
    for total, pushes in sorted(net, key=lambda pair: -pair[0])[:NUMBERED]:
        strongest = max(pushes, key=lambda push: float(np.linalg.norm(push.normal)))
        end = tip(strongest.point, strongest.normal, scale)
        x, y, depth = camera.project(end[None], canvas.size)
        if total >= LEAST and depth[0] > camera.near:
            rows.append((float(y[0]), float(x[0]) + 4.0, f"{total:.3g} N"))
    below = -math.inf
    for wanted, column, text in sorted(rows):
        below = max(wanted, below + size)  # numbers of near contacts are listed below each other
        pen.text((column, below), text, fill=INK, font=letters, anchor="lm", stroke_width=2, stroke_fill=PAPER)
    force, length = scale_bar(camera, scale, canvas.size)
    left, row = round(0.7 * text_size(canvas.height)), canvas.height - 2.2 * text_size(canvas.height)
    words = ((f"{force:g} N", INK), ("normal", NORMAL), ("friction", FRICTION))
    column = left + length + size / 2.0
    for word, colour in words:
        pen.text(
            (column, row), word, fill=colour, font=letters, anchor="lm", stroke_width=2, stroke_fill=(255, 255, 255)
        )
        column += pen.textlength(f"{word}  ", font=letters)
    found = np.array(canvas)
    stroke(found, np.array([[left, row], [left + length, row]]), INK, width=max(size / 6.0, 2.0))
    return found


def scale_bar(camera: Camera, scale: float, size: tuple[int, int]) -> tuple[float, float]:
    """A round force [N], and the length of its arrow at the middle of the view [pixel]; it is at most a sixth of the
    width of the picture, and no longer than the longest arrow."""
    per_force = scale * camera.lens(size).fy / camera.distance
    most = min(size[0] / 6.0 / per_force, LONGEST / scale)
    power = 10.0 ** np.floor(np.log10(most))
    force = float(max(step for step in ROUND if step * power <= most * (1.0 + 1e-9)) * power)
    return force, force * per_force
