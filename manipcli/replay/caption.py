"""Captions of pictures: lines of text, and the timeline of a run."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.text import escape
from manipcli.replay.happening import Mood, happening
from manipcli.replay.playback import Playback
from manipcli.replay.renderer import Image

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont
    from PIL.ImageFont import ImageFont as BitmapFont

Rgb = tuple[int, int, int]

PAPER: Rgb = (255, 255, 255)
INK: Rgb = (30, 36, 44)
QUIET: Rgb = (96, 107, 120)
DONE: Rgb = (47, 132, 79)
FAILED: Rgb = (190, 45, 38)
TRACK: Rgb = (186, 196, 208)
NOW: Rgb = (47, 111, 176)
CAPTION_COLOURS = (INK, QUIET, DONE, FAILED, TRACK, NOW)
MOODS: dict[Mood, Rgb] = {"plain": (66, 76, 88), "good": DONE, "bad": FAILED}
TEXT_SHARE = 0.042
"""Height of the text relative to that of the picture."""


@lru_cache(maxsize=8)
def font(size: int) -> FreeTypeFont | BitmapFont:
    """The font of all pictures, `size` pixels high."""
    from PIL import ImageFont

    return ImageFont.load_default(size)


def text_size(height: int) -> int:
    """Height of the text in a picture of this height [pixel]."""
    return max(round(TEXT_SHARE * height), 9)


def caption(image: Image, playback: Playback, time: float) -> Image:
    """The picture with two lines at the top, and the timeline at the bottom.

    The first line has the step, the task and the time, the second what happens there.
    """
    from PIL import Image as PillowImage
    from PIL import ImageDraw

    canvas = PillowImage.fromarray(image)
    pen = ImageDraw.Draw(canvas)
    size = text_size(canvas.height)
    margin = round(0.7 * size)
    step = playback.step_at(time)
    left = []
    if step is not None:
        left = [(f"{playback.steps.index(step) + 1}/{playback.total}", QUIET), (step.label, INK)]
    left.append((playback.name, QUIET))
    ends = margin, canvas.width - margin
    write_line(pen, (*ends, margin + size / 2), size, left, [(f"{time:.2f} s", INK)], halo=True)
    text, mood = happening(playback, time)
    small = max(round(0.8 * size), 9)
    write_line(pen, (*ends, margin + 1.35 * size + small / 2), small, [(text, MOODS[mood])], halo=True)
    if playback.end > playback.start:
        _timeline(pen, playback, time, (canvas.width, canvas.height), margin)
    return np.asarray(canvas)


def write_line(
    pen: ImageDraw,
    place: tuple[float, float, float],
    size: int,
    left: Sequence[tuple[str, Rgb]],
    right: Sequence[tuple[str, Rgb]] = (),
    *,
    halo: bool = False,
) -> None:
    """Write words into one line; `left` is truncated if it does not fit.

    Args:
        pen: draws into the picture.
        place: left end, right end and vertical centre of the line [pixel].
        size: height of the text [pixel].
        left, right: words and their colours, from the end of the line inwards.
        halo: white around the letters, for text before a dark thing.
    """
    border = max(round(size / 12.0), 1) if halo else 0
    x, end, y = place
    for word, colour in right:
        pen.text((end, y), word, fill=colour, font=font(size), anchor="rm", stroke_width=border, stroke_fill=PAPER)
        end -= pen.textlength(f"{word}  ", font=font(size))
    for word, colour in left:
        text = _cut(pen, word, size, end - x)
        pen.text((x, y), text, fill=colour, font=font(size), anchor="lm", stroke_width=border, stroke_fill=PAPER)
        x += pen.textlength(f"{text}  ", font=font(size))


def _cut(pen: ImageDraw, text: str, size: int, room: float) -> str:
    text = escape(text)
    if pen.textlength(text, font=font(size)) <= room:
        return text
    while text and pen.textlength(f"{text}...", font=font(size)) > room:
        text = text[:-1]
    return f"{text}..." if text else ""


def _timeline(pen: ImageDraw, playback: Playback, time: float, size: tuple[int, int], margin: int) -> None:
    """One bar per step, filled up to `time`; red for a failed step."""
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
