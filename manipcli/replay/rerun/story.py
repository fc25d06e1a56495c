"""What happened, in a Rerun recording: steps and their phases as a track, events as a log, the verdict as a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from manipcli.replay.playback import Playback, PlaybackStep
from manipcli.replay.rerun.timelines import Timelines
from manipcli.replay.verdict_page import verdict_page

if TYPE_CHECKING:
    import rerun as rr

STEPS, PHASES, EVENTS, VERDICT = "/steps", "/steps/phases", "/events", "/verdict"
DONE, WRONG, OTHER = (60, 160, 90), (210, 60, 60), (130, 140, 150)
_IDLE = ""


def log_story(to: rr.RecordingStream, playback: Playback, lines: Timelines) -> None:
    """Steps, phases, events and the verdict."""
    import rerun as rr

    to.log(VERDICT, rr.TextDocument(verdict_page(playback), media_type="text/markdown"), static=True)
    spans = [(step.start, step.end, step.label) for step in playback.steps]
    _log_track(to, STEPS, spans, lines)
    if spans:
        labels, colours = zip(*{step.label: _colour(step) for step in playback.steps}.items(), strict=True)
        to.log(STEPS, rr.StateConfiguration(values=labels, labels=labels, colors=colours), static=True)
    phases = [(phase.start, phase.end, phase.name) for step in playback.steps for phase in step.phases]
    _log_track(to, PHASES, phases, lines)
    _log_events(to, playback, lines)


def _colour(step: PlaybackStep) -> tuple[int, int, int]:
    return {"done": DONE, "failed": WRONG, "timeout": WRONG}.get(step.outcome, OTHER)


def _log_track(to: rr.RecordingStream, path: str, spans: list[tuple[float, float, str]], lines: Timelines) -> None:
    """States from `start` to `end` [s]; nothing in between."""
    import rerun as rr

    states: dict[float, str] = {}
    for start, end, name in sorted(spans):
        states[start] = name
        states[end] = _IDLE
    if states:
        times = sorted(states)
        columns = rr.StateChange.columns(state=[states[time] for time in times])
        to.send_columns(path, lines.columns(times), columns)


def _log_events(to: rr.RecordingStream, playback: Playback, lines: Timelines) -> None:
    """Begins and ends of steps and phases, in order of time."""
    import rerun as rr

    rows: list[tuple[float, str, str]] = []
    for step in playback.steps:
        rows.append((step.start, rr.TextLogLevel.INFO, f"{step.label}: started"))
        rows += ((phase.start, rr.TextLogLevel.DEBUG, f"{step.label}: {phase.name}") for phase in step.phases)
        wrong = _colour(step) == WRONG
        text = f"{step.label}: {step.outcome}{f': {step.text}' if step.text else ''}"
        rows.append((step.end, rr.TextLogLevel.ERROR if wrong else rr.TextLogLevel.INFO, text))
    for expectation in playback.verdict.expectations if playback.verdict is not None else ():
        if expectation.at is not None:
            level = rr.TextLogLevel.ERROR if expectation.missed else rr.TextLogLevel.INFO
            rows.append(
                (
                    expectation.at,
                    level,
                    f"expectation {expectation.name} {expectation.outcome}, tightest here: {expectation.text}",
                )
            )
    if rows:
        rows.sort(key=lambda row: row[0])
        times, levels, texts = zip(*rows, strict=True)
        to.send_columns(EVENTS, lines.columns(times), rr.TextLog.columns(text=texts, level=levels))
