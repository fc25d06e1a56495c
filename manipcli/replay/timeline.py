"""Time in the page: playing, speed, scrubbing, loop, and the steps by name."""

from __future__ import annotations

import html
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from manipcli.core.text import escape
from manipcli.replay.playback import Playback, PlaybackStep

if TYPE_CHECKING:
    import viser

FRAMES = 30.0
"""[Hz] at which a playing run is shown."""
SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "4")
SLIDER_STEPS = 2000
PLAY, PAUSE = "▶ Play", "❚❚ Pause"


class Clock:
    """The time that is shown, which passes while it plays. `tell` is called with each new time, one call at a time.

    Args:
        start, end: [s].
        tell: shows a time.
    """

    def __init__(self, start: float, end: float, tell: Callable[[float], None]) -> None:
        self.start, self.end = start, end
        self.speed = 1.0
        self.loops = False
        self._tell = tell
        self._time = start
        self._playing = False
        self._changed = threading.Condition()
        self._stopped = False
        self._thread = threading.Thread(target=self._run, name="replay clock", daemon=True)

    @property
    def time(self) -> float:
        """[s] what is shown."""
        return self._time

    @property
    def playing(self) -> bool:
        """Whether time passes."""
        return self._playing

    def begin(self) -> None:
        """From now on times are told."""
        self._thread.start()

    def stop(self) -> None:
        """Tell nothing more; returns when the last call has."""
        with self._changed:
            self._stopped = True
            self._changed.notify()
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join()

    def play(self, on: bool) -> None:
        """Let time pass, from the beginning if it was at its end; or not."""
        with self._changed:
            if on and self._time >= self.end:
                self._time = self.start
            self._playing = on
            self._changed.notify()

    def seek(self, to: float) -> None:
        """Show another time [s]."""
        with self._changed:
            self._time = min(max(to, self.start), self.end)
            self._changed.notify()

    def _run(self) -> None:
        told: tuple[float, bool] | None = None
        before = time.monotonic()
        while True:
            with self._changed:
                while not self._stopped and not self._playing and (self._time, self._playing) == told:
                    self._changed.wait()
                if self._stopped:
                    return
                now = time.monotonic()
                if self._playing and told is not None and told[1]:
                    self._pass((now - before) * self.speed)
                before = now
                told = (self._time, self._playing)
            self._tell(told[0])
            if told[1]:
                time.sleep(max(0.0, before + 1.0 / FRAMES - time.monotonic()))

    def _pass(self, seconds: float) -> None:
        self._time += seconds
        if self._time >= self.end:
            self._time = self.start if self.loops else self.end
            self._playing = self.loops


class Timeline:
    """The controls of a clock, in the panel of a page.

    Args:
        server: where.
        playback: its steps and its length.
        clock: what they move.
    """

    def __init__(self, server: viser.ViserServer, playback: Playback, clock: Clock) -> None:
        self._playback = playback
        self._clock = clock
        self._current: PlaybackStep | None = None
        gui = server.gui
        told = _judged(playback)
        if told:
            gui.add_markdown(told)
        self._caption = gui.add_markdown("")
        self._play = gui.add_button(PLAY)
        length = max(playback.end - playback.start, 1e-3)
        self._slider = gui.add_slider(
            "time [s]", playback.start, playback.start + length, length / SLIDER_STEPS, playback.start
        )
        speed = gui.add_dropdown("speed", SPEEDS, initial_value="1")
        loop = gui.add_checkbox("loop", False)
        self._buttons: list[tuple[PlaybackStep, viser.GuiButtonHandle]] = []
        if playback.steps:
            with gui.add_folder("Steps"):
                for step in playback.steps:
                    self._buttons.append((step, self._button(server, step)))

        # The page's own changes have a client; those that follow the clock have none.
        self._slider.on_update(lambda event: clock.seek(self._slider.value) if event.client_id is not None else None)
        self._play.on_click(lambda _: clock.play(not clock.playing))
        speed.on_update(lambda _: setattr(clock, "speed", float(speed.value)))
        loop.on_update(lambda _: setattr(clock, "loops", loop.value))
        self._caption.content = self._text(clock.time)

    def _button(self, server: viser.ViserServer, step: PlaybackStep) -> viser.GuiButtonHandle:
        mark = "✓" if step.outcome == "done" else "✗"
        button = server.gui.add_button(
            f"{mark} {escape(step.label)}  {step.start:.2f} s",
            color="gray",
            hint=f"{step.outcome}: {', '.join(phase.name for phase in step.phases) or step.verb}",
        )
        button.on_click(lambda _: self._clock.seek(step.start))
        return button

    def show(self, now: float) -> None:
        """Put slider, caption and buttons where the time is [s]."""
        self._slider.value = now  # type: ignore[misc]  # viser's setter hides from mypy
        self._play.label = PAUSE if self._clock.playing else PLAY
        self._caption.content = self._text(now)
        current = self._playback.step_at(now)
        if current is not self._current:
            for step, button in self._buttons:
                if step in (self._current, current):
                    button.color = "blue" if step is current else "gray"
            self._current = current

    def _text(self, now: float) -> str:
        """The caption: the step and its phase, and the time."""
        step = self._playback.step_at(now)
        phase = next((one.name for one in reversed(step.phases) if one.start <= now), "") if step is not None else ""
        name = self._playback.name if step is None else step.label
        what = f"**{_plain(name)}**" + (f" · {_plain(phase)}" if phase else "")
        return f"{what} — {now:.2f} of {self._playback.end:.2f} s"


def _judged(playback: Playback) -> str:
    """The verdict and why, and what is missing of the log, as Markdown."""
    lines = []
    if playback.verdict is not None:
        word = playback.verdict.verdict
        lines.append(f"**{'✓' if word == 'passed' else '✗'} {word}** {_plain(playback.verdict.text)}")
    if playback.lost is not None:
        lines.append(_plain(f"The log is not closed: {playback.lost}"))
    return "\n\n".join([*lines, *(f"*{_plain(note)}*" for note in playback.notes)])


def _plain(text: str) -> str:
    """A name as Markdown that means nothing but itself."""
    return "".join(f"&#{ord(c)};" if not c.isalnum() and c != " " else c for c in html.unescape(text))
