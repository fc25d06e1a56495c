"""Pictures and films of a run: `manipcli replay LOG --picture`, `--sheet`, `--video`."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.cli import console
from manipcli.cli.outputs import check_picture
from manipcli.core.errors import Finding, InvalidInput

if TYPE_CHECKING:
    from manipcli.replay.playback import Playback

VIEW, FPS, SPEED = "iso", 25.0, 1.0
"""Where nothing else is said."""
REDRAW_PERIOD = 0.2
"""[s] between two reports of how far a film is."""


class Pictures:
    """What is asked for; looked at before anything is read or drawn.

    Args:
        picture: a moment as PNG, or None.
        at: which moment, or None for the end.
        sheet: all steps as PNG, or None.
        video: a film, or None.
        size: `960x540`, or None for what suits each.
        view: from where, or None.
        fps, speed: of the film, or None.

    Raises:
        InvalidInput: an option that makes no picture, or what a film needs is not installed.
    """

    def __init__(
        self,
        picture: Path | None,
        at: str | None,
        sheet: Path | None,
        video: Path | None,
        *,
        size: str | None,
        view: str | None,
        fps: float | None,
        speed: float | None,
    ) -> None:
        self._picture, self._at, self._sheet, self._video = picture, at, sheet, video
        self._size = size
        self._view, self._fps, self._speed = (
            view or VIEW,
            FPS if fps is None else fps,
            SPEED if speed is None else speed,
        )
        if at is not None and picture is None:
            raise InvalidInput(
                [Finding("USE062", "--at says which moment --picture draws", hint="give --picture, too")]
            )
        for option, value in (("--fps", fps), ("--speed", speed)):
            if value is not None and video is None:
                raise InvalidInput([Finding("USE062", f"{option} is that of a film", hint="give --video, too")])
        for option, given in (("--size", size), ("--view", view)):
            if given is not None and not self.wanted:
                hint = "give --picture, --sheet or --video, too"
                raise InvalidInput([Finding("USE062", f"{option} is that of a picture or a film", hint=hint)])
        check_picture(picture)
        check_picture(sheet)
        if self.wanted:
            from manipcli.replay.camera import direction
            from manipcli.replay.film import check_pace, kind_of
            from manipcli.replay.shots import parse_size

            direction(self._view)
            check_pace(self._fps, self._speed)
            if size is not None:
                parse_size(size)
            if video is not None:
                kind_of(video)

    @property
    def wanted(self) -> bool:
        """Whether there is anything to draw."""
        return any(path is not None for path in (self._picture, self._sheet, self._video))

    @property
    def rate(self) -> float:
        """[Hz] of the moments that are needed."""
        from manipcli.replay.playback import RATE

        return max(RATE, self._fps / self._speed) if self._video is not None else RATE

    def make(self, playback: Playback) -> None:
        """Draws everything that is asked for; each file is there whole or not at all.

        Raises:
            InvalidInput: there is no such moment.
        """
        if not self.wanted:
            return
        from manipcli.core.whole_file import whole_file
        from manipcli.replay import sheet as sheets
        from manipcli.replay.camera import direction
        from manipcli.replay.image import png_bytes
        from manipcli.replay.picture import SIZE
        from manipcli.replay.shots import Shots, moment, parse_size

        towards = direction(self._view)
        size = parse_size(self._size) if self._size is not None else None
        if self._picture is not None:
            when = moment(playback, self._at or "end")
            with (
                whole_file(self._picture) as partial,
                Shots(playback, size=size or SIZE, towards=towards) as shots,
            ):
                console.not_drawn(shots.missing)
                partial.write_bytes(png_bytes(shots.at(when)))
            console.result(str(self._picture))
        if self._sheet is not None:
            with whole_file(self._sheet) as partial:
                partial.write_bytes(png_bytes(sheets.sheet(playback, size=size or sheets.TILE, towards=towards)))
            console.result(str(self._sheet))
        if self._video is not None:
            self._film(self._video, playback, size, towards)

    def _film(
        self, path: Path, playback: Playback, size: tuple[int, int] | None, towards: tuple[float, float, float]
    ) -> None:
        from manipcli.replay import film as films
        from manipcli.replay.shots import Shots

        film = films.cutting(playback, fps=self._fps, speed=self._speed)
        with Shots(playback, size=size or films.SIZE, towards=towards) as shots, _FilmProgress() as progress:
            console.not_drawn(shots.missing)
            films.write_film(path, shots, film, progress=progress)
        rate = len(film.times) / progress.seconds
        console.talk(f"{len(film.times)} frames, {film.duration:.2f} s, drawn at {rate:.1f} frames/s")
        console.result(str(path))


class _FilmProgress:
    """How far a film is: a line on a live terminal, nothing elsewhere. A context manager that leaves no half line."""

    def __init__(self) -> None:
        self._live = console.is_live()
        self._began = time.monotonic()
        self._next = 0.0

    def __enter__(self) -> _FilmProgress:
        return self

    def __exit__(self, *raised: object) -> None:
        if self._live:
            console.redraw("")

    @property
    def seconds(self) -> float:
        """[s] since it began."""
        return max(time.monotonic() - self._began, 1e-9)

    def __call__(self, done: int, total: int) -> None:
        if self._live and self.seconds >= self._next:
            self._next = self.seconds + REDRAW_PERIOD
            console.redraw(f"frame {done} of {total}  {done / self.seconds:.1f} frames/s")
