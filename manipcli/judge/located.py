"""Corrections of the belief by `locate`: its errors against the truth before and after each, from the recording."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array
from manipcli.record.recording import Recording, Span

LOCATED = "located"
"""Kind of the event of a correction; its outcome is the name of the body."""
NEVER = "never located"


@dataclass(frozen=True, slots=True)
class PoseError:
    """How far a believed pose is from the true one: `position` [m] and `rotation` [rad]."""

    position: float
    rotation: float


@dataclass(frozen=True, slots=True)
class Correction:
    """What a `locate` corrected.

    Attributes:
        step: its id; "" for a body that was never located.
        object: the body.
        time: [s] of the correction; 0 without one.
        before, after: errors of the belief at the recorded ticks around it; None where no tick was recorded.
        text: what the robot knows of it.
    """

    step: str
    object: str
    time: float
    before: PoseError | None
    after: PoseError | None
    text: str


class Corrections:
    """Collects them from the successive spans of a recording."""

    def __init__(self, recording: Recording) -> None:
        self._events = [event for event in recording.events if event.kind == LOCATED]
        self._names, self._bodies = recording.believed_names, recording.body_names
        self._between = recording.period / 2.0
        self._before: list[PoseError | None] = [None for _ in self._events]
        self._after = [*self._before]
        looked = {event.outcome for event in self._events}
        self._never = {belief.body: None for belief in recording.beliefs if belief.body not in looked}
        self._start: dict[str, PoseError] = {}

    def add(self, span: Span) -> None:
        """The next ticks."""
        if not span.believed.size:
            return
        for name in self._never:
            if name not in self._start and name in self._names and name in self._bodies:
                self._start[name] = self._error(span, name, 0)
        for k, event in enumerate(self._events):
            if event.outcome not in self._names or event.outcome not in self._bodies:
                continue
            first = int(np.searchsorted(span.states.time, event.time - self._between))
            if first > 0:
                self._before[k] = self._error(span, event.outcome, first - 1)
            if self._after[k] is None and first < len(span.states.time):
                self._after[k] = self._error(span, event.outcome, first)

    def found(self) -> tuple[Correction, ...]:
        """All corrections, in order of time; then bodies that were never located, with the error at the start."""
        located = [
            Correction(event.step, event.outcome, event.time, before, after, event.text)
            for event, before, after in zip(self._events, self._before, self._after, strict=True)
        ]
        return (*located, *(Correction("", name, 0.0, error, None, NEVER) for name, error in self._start.items()))

    def _error(self, span: Span, name: str, row: int) -> PoseError:
        believed: Array = span.believed[row, self._names.index(name)]
        k = self._bodies.index(name)
        position, quat = span.states.body_position[row, k], span.states.body_quat_xyzw[row, k]
        return PoseError(float(np.linalg.norm(believed[:3] - position)), _angle(believed[3:], quat))


def _angle(a: Array, b: Array) -> float:
    """[rad] Between two orientations, unit quaternions (4,), from their chord: exact for small angles."""
    chord = min(float(np.linalg.norm(a - b)), float(np.linalg.norm(a + b)))
    return 4.0 * math.asin(min(1.0, chord / 2.0))
