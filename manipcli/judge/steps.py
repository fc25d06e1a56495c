"""How each step of a recorded run went: what was planned, and what the events say became of it."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any, get_args

from manipcli.judge.verdict import StepOutcome, StepWord
from manipcli.record.recording import Recording, TaskEvent

PLAN_FILE = "plan.json"
"""The attachment with the planned steps: `{"steps": [{"id", "verb", "planned_duration"}, ...]}`."""


def step_outcomes(recording: Recording, *, interrupted: bool) -> tuple[StepOutcome, ...]:
    """One outcome a step, in the order of the plan; without a plan in the log, in the order they started.

    A step that started and never ended was `interrupted` when the run was, else `failed`; one that never started is
    `not_run`. Of several ends of one step (a retry) the last counts.
    """
    planned = _planned(recording)
    known = {step_id for step_id, _, _ in planned}
    for event in recording.events:
        if event.kind == "step_started" and event.step not in known:
            known.add(event.step)
            planned.append((event.step, event.verb, 0.0))
    return tuple(
        _outcome(step_id, verb, duration, recording.events, interrupted) for step_id, verb, duration in planned
    )


def _outcome(step_id: str, verb: str, duration: float, events: Iterable[TaskEvent], interrupted: bool) -> StepOutcome:
    mine = [event for event in events if event.step == step_id]
    started = next((event.time for event in mine if event.kind == "step_started"), None)
    end = next((event for event in reversed(mine) if event.kind == "step_ended"), None)
    word: StepWord
    text = ""
    if end is not None:
        word, text = _word(end.outcome), end.text
        if word != end.outcome:
            text = f"unknown outcome '{end.outcome}' {text}".rstrip()
    elif started is None:
        word = "not_run"
    elif interrupted:
        word = "interrupted"
    else:
        word, text = "failed", "started and never ended"
    return StepOutcome(
        id=step_id,
        verb=verb,
        outcome=word,
        started=started,
        ended=None if end is None else end.time,
        planned_duration=duration,
        text=text,
    )


def _word(text: str) -> StepWord:
    for word in get_args(StepWord):
        if word == text:
            known: StepWord = word
            return known
    return "failed"


def _planned(recording: Recording) -> list[tuple[str, str, float]]:
    """Id, verb and planned duration [s] of each step; empty when the log carries no readable plan."""
    try:
        # Any: what a file holds is not known before it is looked at.
        plan: Any = json.loads(recording.attachments.get(PLAN_FILE, b"{}"))
        return [(str(s["id"]), str(s["verb"]), float(s["planned_duration"])) for s in plan.get("steps", [])]
    except (ValueError, KeyError, TypeError, AttributeError):
        return []
