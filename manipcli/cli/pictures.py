"""Pictures and videos of a run: `manipcli replay LOG --picture`, `--sheet`, `--video`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.cli import console
from manipcli.cli.outputs import check_picture
from manipcli.core.errors import Diagnostic, InvalidInput

if TYPE_CHECKING:
    from manipcli.replay.camera import Vector
    from manipcli.replay.playback import Playback

VIEW, FPS, SPEED = "iso", 25.0, 1.0
"""The defaults."""
REDRAW_PERIOD = 0.2
"""[s] between two reports of the progress of a video."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Pictures:
    """The options that draw a run, None where an option is not given; checked before anything is read or drawn.

    Raises:
        InvalidInput: an option has no effect or an unusable value, or the extra of the video is not installed.
    """

    picture: Path | None
    at: str | None
    sheet: Path | None
    video: Path | None
    size: str | None
    view: str | None
    fps: float | None
    speed: float | None
    forces: bool | None = None

    def __post_init__(self) -> None:
        for option, value, drawn, needed in (
            ("--at", self.at, self.picture is not None, "--picture"),
            ("--fps", self.fps, self.video is not None, "--video"),
            ("--speed", self.speed, self.video is not None, "--video"),
            ("--size", self.size, self.wanted, "--picture, --sheet or --video"),
            ("--view", self.view, self.wanted, "--picture, --sheet or --video"),
            ("--forces", self.forces, self.wanted, "--picture, --sheet or --video"),
        ):
            if value is not None and not drawn:
                hint = f"add {needed}"
                raise InvalidInput([Diagnostic("USE062", f"{option} has no effect without {needed}", hint=hint)])
        check_picture(self.picture)
        check_picture(self.sheet)
        if self.wanted:
            from manipcli.replay.video import check_ending, check_pace

            self._towards(), self._size((0, 0))
            check_pace(*self._pace)
            if self.video is not None:
                check_ending(self.video)

    @property
    def wanted(self) -> bool:
        """Whether there is anything to draw."""
        return any(path is not None for path in (self.picture, self.sheet, self.video))

    @property
    def rate(self) -> float:
        """[Hz] of the poses that are needed."""
        from manipcli.replay.playback import RATE

        fps, speed = self._pace
        return max(RATE, fps / speed) if self.video is not None else RATE

    @property
    def _pace(self) -> tuple[float, float]:
        return (FPS if self.fps is None else self.fps, SPEED if self.speed is None else self.speed)

    def _towards(self) -> Vector:
        from manipcli.replay.camera import direction

        return direction(self.view or VIEW)

    def _size(self, default: tuple[int, int]) -> tuple[int, int]:
        from manipcli.replay.frames import parse_size

        return default if self.size is None else parse_size(self.size)

    def make(self, playback: Playback) -> None:
        """Draws the requested files; each is written completely or not at all.

        Raises:
            InvalidInput: `--at` is neither a time nor a step of the run.
        """
        for path, draw in ((self.picture, self._picture), (self.sheet, self._sheet), (self.video, self._video)):
            if path is not None:
                draw(path, playback)
                console.result(str(path))

    def _picture(self, path: Path, playback: Playback) -> None:
        from manipcli.core.whole_file import whole_file
        from manipcli.replay.frames import Frames, moment
        from manipcli.replay.renderer import SIZE, png_bytes

        when = moment(playback, self.at or "end")
        frames = Frames(playback, size=self._size(SIZE), towards=self._towards(), forces=self.forces)
        console.not_drawn(frames.missing)
        with whole_file(path) as partial:
            partial.write_bytes(png_bytes(frames.at(when)))

    def _sheet(self, path: Path, playback: Playback) -> None:
        from manipcli.core.whole_file import whole_file
        from manipcli.replay.contact_sheet import TILE, contact_sheet
        from manipcli.replay.renderer import png_bytes

        with whole_file(path) as partial:
            image = contact_sheet(playback, size=self._size(TILE), towards=self._towards(), forces=self.forces)
            partial.write_bytes(png_bytes(image))

    def _video(self, path: Path, playback: Playback) -> None:
        from manipcli.replay.frames import Frames
        from manipcli.replay.video import SIZE, Video, write_video

        fps, speed = self._pace
        video = Video.of(playback, fps=fps, speed=speed)
        began = time.monotonic()
        frames = Frames(playback, size=self._size(SIZE), towards=self._towards(), forces=self.forces)
        console.not_drawn(frames.missing)
        try:
            write_video(path, frames, video, progress=_progress_line(began) if console.is_live() else None)
        finally:
            if console.is_live():
                console.redraw("")
        rate = len(video.times) / max(time.monotonic() - began, 1e-9)
        console.talk(f"{len(video.times)} frames, {video.duration:.2f} s, drawn at {rate:.1f} frames/s")


def _progress_line(began: float) -> Callable[[int, int], None]:
    """Shows on one line of the terminal how many frames are drawn."""
    shown = began

    def show(done: int, total: int) -> None:
        nonlocal shown
        now = time.monotonic()
        if now >= shown + REDRAW_PERIOD:
            shown = now
            console.redraw(f"frame {done} of {total}  {done / (now - began):.1f} frames/s")

    return show
