"""Outcomes of the steps of a recorded run, from its plan and its events."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from enum import StrEnum
from itertools import pairwise
from typing import get_args

from manipcli.judge.verdict import Attempt, BlockOutcome, StepOutcome, StepWord
from manipcli.plan.outline import PLAN_FILE, BlockOutline, PlanOutline
from manipcli.record.channels import EVENTS
from manipcli.record.recording import Recording, TaskEvent


class RunStatus(StrEnum):
    """How a run ended, in the metadata of its log: finished (with or without failed steps), simulation failed, or
    interrupted by the user."""

    COMPLETE = "complete"
    FAILED = "failed"
    INTERRUPTED = "interrupted"


STEPS_ENDED = "steps_ended"
"""Kind of the event at the end of the steps of a task in a live session; what clients do later is not judged."""
ENDED = (RunStatus.COMPLETE, RunStatus.FAILED)
"""The statuses of a run that was not interrupted."""


def step_outcomes(recording: Recording, *, interrupted: bool) -> tuple[StepOutcome, ...]:
    """The outcome of each step, in the order of the plan; without a plan in the log, in the order of their starts.

    Steps that are not in the plan are those that clients of a live session asked for; they are excused.

    A step without an end is `interrupted` if the run was, else `failed`; a step without a start is `not_run`, or
    `skipped` if its branch was not taken. The last attempt counts.
    """
    plan = PlanOutline.read(recording.attachments.get(PLAN_FILE))
    planned = [(step.id, step.verb, step.planned_duration) for step in plan.steps]
    known = {step_id for step_id, _, _ in planned}
    own = frozenset(known)
    for event in recording.events:
        if event.kind == "step_started" and event.step not in known:
            known.add(event.step)
            planned.append((event.step, event.verb, 0.0))
    outcomes = (_outcome(step_id, verb, duration, recording.events, interrupted) for step_id, verb, duration in planned)
    return tuple(replace(each, excused=True) if own and each.id not in own else each for each in outcomes)


def block_outcomes(recording: Recording, *, interrupted: bool) -> tuple[BlockOutcome, ...]:
    """The outcome of each block, in the order of the plan; () without a plan in the log."""
    plan = PlanOutline.read(recording.attachments.get(PLAN_FILE))
    return tuple(_block(block, recording.events, interrupted) for block in plan.blocks)


def _block(block: BlockOutline, events: Iterable[TaskEvent], interrupted: bool) -> BlockOutcome:
    mine = [event for event in events if event.step == block.id]
    starts = [event.time for event in mine if event.kind == "block_started"]
    choice = next((event for event in reversed(mine) if event.kind == "branch"), None)
    outcome, ended, text = "not_run", None, ""
    if starts:
        outcome = "interrupted" if interrupted else "failed"
        for event in mine:
            if event.kind == "block_started":
                outcome, ended, text = "interrupted" if interrupted else "failed", None, ""
            elif event.kind == "block_ended":
                outcome, ended, text = event.outcome, event.time, event.text
    if mine and mine[-1].kind == "block_skipped":
        outcome, text = "skipped", mine[-1].text
    return BlockOutcome(
        id=block.id,
        word=block.word,
        first=block.first,
        last=block.last,
        parent=block.parent,
        outcome=_word(outcome),
        started=starts[0] if starts else None,
        ended=ended,
        attempts=len(starts),
        taken="" if choice is None else choice.outcome,
        text=text or ("" if choice is None else choice.text),
        tolerated=any(event.kind == "block_tolerated" for event in mine[-1:]),
    )


def left_out(recording: Recording) -> str:
    """Which events are missing in the log of a complete run; "" if none are.

    A complete run has at least one start of a step, and an end for every start.
    """
    if EVENTS in recording.silent:
        return recording.unknown(EVENTS)
    outcomes = step_outcomes(recording, interrupted=True)
    begun = next((step for step in outcomes if step.outcome == "interrupted" and step.ended is None), None)
    return "" if begun is None else f"the end of step '{begun.id}' is missing, though the run finished"


def _outcome(
    step_id: str, verb: str, duration: float | None, events: Iterable[TaskEvent], interrupted: bool
) -> StepOutcome:
    mine = [event for event in events if event.step == step_id]
    attempts = tuple(_attempts(mine, interrupted))
    last = attempts[-1] if attempts else None
    for event in mine:  # in this branch, or during the run
        if event.kind == "step_planned":
            with suppress(ValueError):
                duration = float(event.text)
    if mine and mine[-1].kind == "step_skipped":
        return StepOutcome(step_id, verb, "skipped", None, None, duration, mine[-1].text, attempts)
    return StepOutcome(
        id=step_id,
        verb=verb,
        outcome="not_run" if last is None else last.outcome,
        started=None if last is None else attempts[0].started,
        ended=None if last is None else last.ended,
        planned_duration=duration,
        text=last.text if last is not None else mine[-1].text if mine else "",
        attempts=attempts,
        tolerated=bool(mine) and mine[-1].kind == "step_tolerated",
        replanned=tuple(event.text for event in mine if event.kind == "replanned"),
    )


def _attempts(events: Sequence[TaskEvent], interrupted: bool) -> Iterator[Attempt]:
    """The attempts in the events of one step: each from its start to the last end before the next start."""
    starts = [k for k, event in enumerate(events) if event.kind == "step_started"]
    for start, stop in pairwise([*starts, len(events)]):
        begun = events[start].time
        end = next((event for event in reversed(events[start:stop]) if event.kind == "step_ended"), None)
        if end is None:
            word: StepWord = "interrupted" if interrupted else "failed"
            yield Attempt(word, begun, None, "" if interrupted else "started and never ended")
            continue
        word, text = _word(end.outcome), end.text
        if word != end.outcome:
            text = f"unknown outcome '{end.outcome}' {text}".rstrip()
        yield Attempt(word, begun, end.time, text)


def _word(text: str) -> StepWord:
    for word in get_args(StepWord):
        if word == text:
            known: StepWord = word
            return known
    return "failed"
