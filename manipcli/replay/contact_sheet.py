"""Contact sheet of a run: one picture per step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from manipcli.replay.camera import FROM, Vector
from manipcli.replay.caption import DONE, FAILED, INK, PAPER, QUIET, font, text_size, write_line
from manipcli.replay.frames import Frames, clearest_time
from manipcli.replay.playback import Playback
from manipcli.replay.renderer import Image

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

TILE = (480, 360)
"""Size of one picture [pixel]."""
GAP = 8
MOMENTS = 6
"""Number of pictures of a run without steps."""


@dataclass(frozen=True, slots=True)
class Tile:
    """Content of a picture; `time` is None for a step that did not start."""

    label: str
    time: float | None
    outcome: str
    text: str = ""


def tiles(playback: Playback) -> tuple[Tile, ...]:
    """One tile per step, including steps that did not start; without steps, evenly spaced times of the run."""
    if not playback.steps:
        times = np.linspace(playback.start, playback.end, MOMENTS if playback.end > playback.start else 1)
        return tuple(Tile("", float(time), "") for time in times)
    begun = [Tile(step.label, clearest_time(playback, step), step.outcome, step.text) for step in playback.steps]
    judged = playback.verdict.steps if playback.verdict is not None else ()
    known = {step.id for step in playback.steps}
    return (*begun, *(Tile(step.id, None, step.outcome, step.text) for step in judged if step.id not in known))


def columns_of(count: int) -> int:
    """Number of columns, at most four."""
    return min(count, 3 if count <= 9 and count != 4 else 4)


def contact_sheet(
    playback: Playback, *, size: tuple[int, int] = TILE, towards: Vector = FROM, forces: bool | None = None
) -> Image:
    """The sheet.

    Args:
        playback: the run.
        size: width and height of each picture [pixel].
        towards: direction from the scene to the camera.
        forces: draw contact forces; None: in steps that failed.
    """
    from PIL import Image as PillowImage
    from PIL import ImageDraw as Drawing

    shown = tiles(playback)
    columns = columns_of(len(shown))
    rows = math.ceil(len(shown) / columns)
    letter = text_size(size[1])
    strip = round(2.1 * letter)
    head = round(2.4 * letter)
    high = size[1] + strip
    whole = PillowImage.new("RGB", (columns * (size[0] + GAP) + GAP, head + rows * (high + GAP)), PAPER)
    pen = Drawing.Draw(whole)
    _heading(pen, playback, whole.width, head, letter)
    frames = Frames(playback, size=size, towards=towards, captions=False, forces=forces)
    for k, tile in enumerate(shown):
        row, column = divmod(k, columns)
        left, top = GAP + column * (size[0] + GAP), head + row * (high + GAP)
        if tile.time is None:
            pen.rectangle((left, top, left + size[0] - 1, top + size[1] - 1), fill=(240, 242, 245))
            middle = (left + size[0] / 2, top + size[1] / 2)
            pen.text(middle, "not started", fill=QUIET, font=font(letter), anchor="mm")
        else:
            whole.paste(PillowImage.fromarray(frames.at(tile.time)), (left, top))
        _label(pen, tile, k + 1, (left, top + size[1], size[0], strip), letter)
    return np.asarray(whole)


def _heading(pen: ImageDraw, playback: Playback, width: int, height: int, letter: int) -> None:
    """Task and cause of failure at the left, verdict at the right."""
    verdict = playback.verdict
    left, right = [(playback.name, INK)], []
    if verdict is not None:
        left += [(verdict.text, QUIET)] if verdict.text else []
        colour = DONE if verdict.verdict == "passed" else FAILED
        right = [(f"{verdict.verdict}  {verdict.simulated_time:.2f} s", colour)]
    write_line(pen, (GAP, width - GAP, height / 2), letter, left, right)


def _label(pen: ImageDraw, tile: Tile, number: int, box: tuple[int, int, int, int], letter: int) -> None:
    """Number, name and cause of failure at the left, outcome and time at the right."""
    left, top, width, height = box
    colour = DONE if tile.outcome == "done" else QUIET if tile.outcome in ("", "not_run", "skipped") else FAILED
    time = [] if tile.time is None else [(f"{tile.time:.2f} s", QUIET)]
    why = f": {tile.text}" if tile.text and tile.outcome not in ("done", "") else ""
    write_line(
        pen,
        (left + 3, left + width - 3, top + height / 2),
        letter,
        [(str(number), QUIET), (tile.label + why, INK)],
        [*time, (tile.outcome.replace("_", " "), colour)],
    )
