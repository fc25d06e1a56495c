"""Picture of a plan in its scene: the tool's path by step, paths that were tried and dropped, start and end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.text import number_of
from manipcli.replay.camera import FROM, Vector
from manipcli.replay.caption import FAILED, INK, PAPER, QUIET, font, text_size, write_line
from manipcli.replay.figure import COLOURS
from manipcli.replay.frames import Frames
from manipcli.replay.planned_playback import TriedPath
from manipcli.replay.playback import Playback
from manipcli.replay.renderer import SIZE, Image
from manipcli.replay.strokes import TOUCHING, Rgb, stroke

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

TRIED: Final[Rgb] = (128, 134, 142)
"""Colour of a path that was dropped for another reason than a collision; of the others `FAILED`."""
GHOST: Final[Rgb] = (70, 130, 200)
RED: Final = "#c8403f"
PALETTE: Final = tuple((int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)) for text in COLOURS if text != RED)
"""Colours of steps; red is for collisions."""
CORNERS: Final[tuple[Vector, ...]] = (
    FROM,
    (1.0, -0.75, 0.55),
    (-1.0, 0.75, 0.55),
    (-1.0, -0.75, 0.55),
    (0.1, 0.0, 1.0),
)
"""Views that are compared; the last is from above."""
LOOK: Final = (200, 150)
NOTABLE: Final = 0.15
"""Share of the path by which a view must be better than the default."""
MOST: Final = 40
"""Most paths that are drawn of those that were dropped."""
LEGEND: Final = 12
"""Most entries of the legend for steps."""
NAMED: Final = 3
"""Most collisions with the names of their parts."""
SHORTEST: Final = 0.005
"""[m] A step whose tool moves less has no line."""


def plan_picture(
    playback: Playback,
    tried: Sequence[TriedPath],
    *,
    refused: str = "",
    size: tuple[int, int] = SIZE,
    towards: Vector | None = None,
) -> tuple[Image, tuple[str, ...]]:
    """The picture, and the parts that cannot be drawn, one line each.

    Args:
        playback: of the plan.
        tried: paths that were dropped.
        refused: why there is no plan; "" if there is one.
        size: width and height [pixel].
        towards: direction from the scene to the camera; None: see `clearest_view`.
    """
    towards = clearest_view(playback) if towards is None else towards
    frames = Frames(playback, size=size, towards=towards, captions=False, forces=False)
    image, depth = frames.between(playback.start, playback.end, GHOST)
    width = max(size[1] / 240.0, 1.5)

    def project(points: Array) -> tuple[Array, Array]:
        x, y, away = frames.camera.project(points, size)
        return np.stack([x, y], axis=1), away

    for path in tried[:MOST]:
        at, away = project(path.points)
        colour = TRIED if path.at is None else FAILED
        stroke(image, at, colour, width=0.5 * width, opacity=0.85, depth=away, hidden_by=depth)
    steps = [] if refused else _lines(playback)
    for _, colour, points in steps:
        at, away = project(points)
        stroke(image, at, PAPER, width=2.0 * width, opacity=0.6, depth=away, hidden_by=depth)
        stroke(image, at, colour, width=width, depth=away, hidden_by=depth)
    hits = [(project(path.points[path.at][None])[0][0], path.between) for path in tried[:MOST] if path.at is not None]
    for at, _ in hits:
        for sign in (1.0, -1.0):
            arm = 1.6 * width * np.array([1.0, sign])
            stroke(image, np.stack([at - arm, at + arm]), FAILED, width=0.8 * width)
    return _written(image, playback, steps, tried, hits, refused), frames.missing


def _lines(playback: Playback) -> list[tuple[str, Rgb, Array]]:
    """Name, colour and tool path of each step that moves the tool."""
    path = playback.tool_path()
    found: list[tuple[str, Rgb, Array]] = []
    if not len(path):
        return []
    for step in playback.steps:
        first, last = playback.index(step.start), playback.index(step.end)
        points = path[first : last + 1]
        if np.ptp(points, axis=0).max() > SHORTEST:
            found.append((step.label, PALETTE[len(found) % len(PALETTE)], points))
    return found


def clearest_view(playback: Playback) -> Vector:
    """The direction from which most of the tool's path is not hidden by things that do not move; of equal ones, the
    default."""
    points = playback.tool_path()
    shares = []
    for towards in CORNERS:
        frames = Frames(playback, size=LOOK, towards=towards, captions=False, forces=False)
        _, depth = frames.between(playback.start, playback.end, GHOST)
        x, y, away = frames.camera.project(points, LOOK)
        column, row = (np.clip(values.astype(int), 0, most - 1) for values, most in zip((x, y), LOOK, strict=True))
        shares.append(float(np.mean(away < depth[row, column] + TOUCHING)) if len(points) else 0.0)
    best = max(shares)
    return next(towards for towards, share in zip(CORNERS, shares, strict=True) if share > best - NOTABLE)


def _written(
    image: Image,
    playback: Playback,
    steps: Sequence[tuple[str, Rgb, Array]],
    tried: Sequence[TriedPath],
    hits: Sequence[tuple[Array, str]],
    refused: str,
) -> Image:
    """The picture with its two lines, its legend, and the parts at the first collisions."""
    from PIL import Image as PillowImage
    from PIL import ImageDraw

    canvas = PillowImage.fromarray(image)
    pen = ImageDraw.Draw(canvas)
    size = text_size(canvas.height)
    small, margin = max(round(0.7 * size), 9), round(0.7 * size)
    ends = margin, canvas.width - margin
    duration = [] if refused else [(f"{playback.end - playback.start:.2f} s", INK)]
    head = "no plan" if refused else f"planned: {number_of(len(playback.steps), 'step')}"
    write_line(pen, (*ends, margin + size / 2), size, [(playback.name, INK), (head, QUIET)], duration, halo=True)
    dropped = sum(path.at is not None for path in tried)
    said = "robot at the start, translucent at the end"
    said = f"{said}; {number_of(len(tried), 'other path')} tried" if tried else said
    said = f"{said}, {dropped} in collision" if dropped else said
    said = f"{said}; {MOST} are drawn" if len(tried) > MOST else said
    line = (refused, FAILED) if refused else (said, QUIET)
    write_line(pen, (*ends, margin + 1.35 * size + small / 2), small, [line], halo=True)
    entries = [(name, colour) for name, colour, _ in steps[:LEGEND]]
    entries += [(f"and {len(steps) - LEGEND} more", QUIET)] if len(steps) > LEGEND else []
    entries += [("tried, in collision at x", FAILED)] if dropped else []
    entries += [("tried", TRIED)] if len(tried) > dropped else []
    top = canvas.height - margin - 1.3 * small * len(entries)
    for k, (name, colour) in enumerate(entries):
        row = top + 1.3 * small * (k + 0.5)
        pen.rectangle((margin, row - small / 6, margin + 1.6 * small, row + small / 6), fill=colour)
        _word(pen, (margin + 2.2 * small, row), name, INK, small)
    named: dict[str, Array] = {}
    for at, between in hits:
        named.setdefault(between, at)
    for between, at in [*named.items()][:NAMED]:
        _word(pen, (float(at[0]) + small, float(at[1])), between, FAILED, small)
    return np.asarray(canvas)


def _word(pen: ImageDraw, at: tuple[float, float], text: str, colour: Rgb, size: int) -> None:
    pen.text(at, text, fill=colour, font=font(size), anchor="lm", stroke_width=2, stroke_fill=PAPER)
