"""Moments of a run to mark over its curves: contacts, grasps, releases, re-plans and failures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

from manipcli.model.grasp import BRIDGED, LINK
from manipcli.plan.motion import CLOSING, OPENING
from manipcli.replay.playback import Playback

Kind = Literal["contact", "grasp", "release", "lost", "replan", "stop", "failure"]

EVENTS: Final[dict[str, Kind]] = {"replanned": "replan", "watch_broken": "stop", "emergency_stop": "stop"}
"""Events of the log that are marks."""
SHORTEST: Final = 0.1
"""[s] Least duration of a contact that is marked."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A moment at `time` [s]; `text` is one line."""

    time: float
    kind: Kind
    text: str


def marks(playback: Playback) -> tuple[Mark, ...]:
    """The marks of a run, in order of time."""
    found = [Mark(event.time, EVENTS[event.kind], event.text) for event in playback.events if event.kind in EVENTS]
    found += [Mark(cause.at, "failure", cause.title) for cause in playback.causes if cause.at is not None]
    closed = [phase.end for step in playback.steps for phase in step.phases if phase.name == CLOSING]
    for body, begin, end in _touches(playback):
        grasped = next((at for at in closed if begin - BRIDGED <= at <= end), None)
        found.append(Mark(begin, "contact", f"contact: robot and '{body}'"))
        if grasped is not None:
            found.append(Mark(grasped, "grasp", f"grasp: '{body}'"))
            if end < playback.end:
                found.append(
                    Mark(end, "release", f"release: '{body}'")
                    if _opens(playback, end)
                    else Mark(end, "lost", f"contact lost: robot and '{body}'")
                )
    return tuple(sorted((mark for mark in found if mark.time <= playback.end), key=lambda mark: mark.time))


def _opens(playback: Playback, time: float) -> bool:
    """Whether the hand opens at `time` [s]."""
    phases = (phase for step in playback.steps for phase in step.phases if phase.name == OPENING)
    return any(phase.start <= time <= phase.end + BRIDGED for phase in phases)


def _touches(playback: Playback) -> Iterator[tuple[str, float, float]]:
    """Each body that the robot touched, from when to when [s]; gaps up to `BRIDGED` are closed."""
    last = playback.start
    since: dict[str, float] = {}
    seen: dict[str, float] = {}
    for time, contacts in zip(playback.times.tolist(), playback.contacts, strict=True):
        touched = {
            b if a.startswith(LINK) else a
            for a, b in ((contact.a, contact.b) for contact in contacts if contact.force > 0.0)
            if a.startswith(LINK) != b.startswith(LINK)
        }
        for body in touched:
            since.setdefault(body, time)
            seen[body] = time
        for body in [body for body, at in seen.items() if time - at > max(BRIDGED, 1.5 * (time - last))]:
            begin, end = since.pop(body), seen.pop(body)
            if end - begin >= SHORTEST:
                yield body, begin, end
        last = time
    for body, begin in since.items():
        if playback.end - begin >= SHORTEST:
            yield body, begin, playback.end
