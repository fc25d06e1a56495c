"""What is written into a picture of a run: the step, the time, and where in the run this is."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.text import escape
from manipcli.replay.playback import Playback
from manipcli.replay.renderer import Image

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont
    from PIL.ImageFont import ImageFont as BitmapFont

Rgb = tuple[int, int, int]

INK: Rgb = (30, 36, 44)
QUIET: Rgb = (96, 107, 120)
DONE: Rgb = (47, 132, 79)
FAILED: Rgb = (190, 45, 38)
TRACK: Rgb = (186, 196, 208)
NOW: Rgb = (47, 111, 176)
CAPTION_COLOURS = (INK, QUIET, DONE, FAILED, TRACK, NOW)
TEXT_SHARE = 0.042
"""Height of the text in that of the picture."""


@lru_cache(maxsize=8)
def font(size: int) -> FreeTypeFont | BitmapFont:
    """The font of all pictures, `size` pixels high."""
    from PIL import ImageFont

    return ImageFont.load_default(size)


def text_size(height: int) -> int:
    """[pixel] Of the text in a picture of that height."""
    return max(round(TEXT_SHARE * height), 9)


def caption(image: Image, playback: Playback, time: float) -> Image:
    """The picture with the name of the step that is on and the time at its top, and the timeline at its bottom."""
    from PIL import Image as PillowImage
    from PIL import ImageDraw

    canvas = PillowImage.fromarray(image)
    pen = ImageDraw.Draw(canvas)
    size = text_size(canvas.height)
    margin = round(0.7 * size)
    clock = f"{time:.2f} s"
    width = pen.textlength(clock, font=font(size))
    pen.text((canvas.width - margin, margin), clock, fill=INK, font=font(size), anchor="ra")
    step = playback.step_at(time)
    if step is not None:
        number = f"{playback.steps.index(step) + 1}/{playback.total}"
        room = canvas.width - 3.0 * margin - width
        x = float(margin)
        pen.text((x, margin), number, fill=QUIET, font=font(size), anchor="la")
        x += pen.textlength(number + "  ", font=font(size))
        pen.text((x, margin), cut(pen, step.label, size, room - x), fill=INK, font=font(size), anchor="la")
    if playback.end > playback.start:
        _timeline(pen, playback, time, (canvas.width, canvas.height), margin)
    return np.asarray(canvas)


def cut(pen: ImageDraw, text: str, size: int, room: float) -> str:
    """As much of a text as there is room for [pixel]."""
    text = escape(text)
    if pen.textlength(text, font=font(size)) <= room:
        return text
    while text and pen.textlength(f"{text}...", font=font(size)) > room:
        text = text[:-1]
    return f"{text}..." if text else ""


def _timeline(pen: ImageDraw, playback: Playback, time: float, size: tuple[int, int], margin: int) -> None:
    """One bar a step, filled up to now; of a step that failed, red."""
    high = max(round(0.009 * size[1]), 2)
    top = size[1] - margin // 2 - high
    span = playback.end - playback.start

    def x(at: float) -> float:
        return margin + (at - playback.start) / span * (size[0] - 2 * margin)

    bars = [(step.start, step.end, step.outcome == "done") for step in playback.steps]
    for start, end, done in bars or [(playback.start, playback.end, True)]:
        last = max(x(end) - 1.0, x(start))  # a gap between two steps
        pen.rectangle((x(start), top, last, top + high), fill=TRACK if done else _pale(FAILED))
        if time > start:
            pen.rectangle((x(start), top, min(last, x(time)), top + high), fill=NOW if done else FAILED)


def _pale(colour: Rgb) -> Rgb:
    red, green, blue = ((value + 2 * 235) // 3 for value in colour)
    return red, green, blue
