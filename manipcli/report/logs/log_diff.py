"""Differences of two logs: inputs, steps, expectations, and the first differing message."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from manipcli.core.text import number_of
from manipcli.judge.measures.step_measures import StepMeasures
from manipcli.judge.verdict import ExpectationOutcome, Verdict
from manipcli.record.channels import JOINT_STATES, TF
from manipcli.record.foreign.compare import Comparison
from manipcli.record.read.compare_entries import EntryDifference
from manipcli.report.display_quantity import quantity
from manipcli.report.json import Json, dumps, number, plain
from manipcli.report.logs.comparison import (
    Names,
    counted,
    entries_lines,
    first_text,
    messages_object,
    topics_table,
)
from manipcli.report.table import table
from manipcli.report.text import FAIL, PASS

_NAMES: Names = ("in a", "in b")
_UNITS = {"duration": "s", "turned": "rad", "slid": "m", "tool": "m", "force": "N", "work": "J"}
"""Measures of a step and their units."""
_HEADERS = {
    "duration": "duration",
    "turned": "revolute travel",
    "slid": "prismatic travel",
    "tool": "tool path",
    "force": "peak force",
    "work": "work",
}
MOST_TOPICS = 30
ROUNDING = 1e-9
"""Relative."""


@dataclass(frozen=True, slots=True)
class LogSide:
    """One of two logs of runs, judged and measured."""

    task: str
    robot: str
    versions: Mapping[str, str]
    verdict: Verdict
    steps: tuple[StepMeasures, ...]


@dataclass(frozen=True, slots=True)
class LogDiff:
    """Two compared logs.

    Attributes:
        a, b: paths of the logs.
        sides: both logs as runs; None if one was not written by manipcli.
        entries: metadata and attachments that differ, the inputs of the runs.
        messages: comparison of the messages of all topics.
        notes: what is not compared, and why.
        tolerance: tolerance of numbers in messages.
    """

    a: str
    b: str
    sides: tuple[LogSide, LogSide] | None
    entries: tuple[EntryDifference, ...]
    messages: Comparison
    notes: tuple[str, ...]
    tolerance: float

    @property
    def same(self) -> bool:
        """Whether all messages and the verdicts are the same."""
        return self.messages.same and bool(self.messages.topics) and self._judged_alike

    @property
    def _judged_alike(self) -> bool:
        if self.sides is None:
            return True
        a, b = (side.verdict for side in self.sides)
        if (a.task, a.verdict) != (b.task, b.verdict):
            return False
        steps = [[(step.id, step.outcome) for step in verdict.steps] for verdict in (a, b)]
        expected = [
            [(expectation.name, expectation.outcome) for expectation in verdict.expectations] for verdict in (a, b)
        ]
        return steps[0] == steps[1] and expected[0] == expected[1]


def render_text(diff: LogDiff) -> str:
    """Different inputs, steps, expectations, the first difference, and the result."""
    lines = [f"a: {diff.a}{_about(diff, 0)}", f"b: {diff.b}{_about(diff, 1)}", ""]
    lines += [f"note: {note}" for note in diff.notes]
    lines += [f"input: {line}" for line in entries_lines(diff.entries, _NAMES)]
    lines += [""] if lines[-1] else []
    if diff.sides is not None:
        for part in (_steps(*diff.sides), _expectations(*diff.sides)):
            lines += [part, ""] if part else []
    unlike = [topic for topic in diff.messages.topics if not topic.same]
    if unlike:
        shown = topics_table(unlike[:MOST_TOPICS], _NAMES)
        lines += [shown, ""]
    first = diff.messages.first
    if first is not None:
        lines.append(f"{FAIL} first difference: {first_text(first, _NAMES)}")
    for topic in unlike:
        if topic.name in (JOINT_STATES, TF) and topic.first is not None and topic.first != first:
            lines.append(f"{FAIL} {topic.name} differs first: {first_text(topic.first, _NAMES)}")
    lines.append(_answer(diff))
    return "\n".join(lines)


def _answer(diff: LogDiff) -> str:
    if not diff.messages.topics:
        return f"{FAIL} different"
    if not diff.messages.same:
        more = f", numbers by more than {diff.tolerance:g}" if diff.tolerance else ""
        return f"{FAIL} different{more}: {counted(diff.messages)}"
    within = f" within {diff.tolerance:g}" if diff.tolerance else ""
    if diff.same:
        judged = ", same verdict" if diff.sides else ""
        return f"{PASS} no difference{within}: {number_of(diff.messages.messages, 'message')}{judged}"
    return f"{FAIL} different: same messages{within}, different verdict"


def render_json(diff: LogDiff) -> str:
    """The comparison as one JSON object; numbers are SI."""
    return dumps(
        {
            "a": diff.a,
            "b": diff.b,
            "same": diff.same,
            "tolerance": diff.tolerance,
            "notes": list(diff.notes),
            "made_from": plain(diff.entries),
            "runs": None if diff.sides is None else [_side_object(side) for side in diff.sides],
            "steps": [] if diff.sides is None else [_pair_object(a, b) for a, b in _paired(*diff.sides)],
            **messages_object(diff.messages),
        }
    )


def _about(diff: LogDiff, k: int) -> str:
    if diff.sides is None:
        return ""
    side = diff.sides[k]
    versions = ", ".join(f"{name} {version}" for name, version in side.versions.items())
    return f"  ({side.task} {side.verdict.verdict}, robot {side.robot}, seed {side.verdict.seed}, {versions})"


def _paired(a: LogSide, b: LogSide) -> list[tuple[StepMeasures | None, StepMeasures | None]]:
    """Steps with the same id, in the order of the first log; then steps of the second log alone."""
    of_b = {step.id: step for step in b.steps}
    pairs: list[tuple[StepMeasures | None, StepMeasures | None]] = [(step, of_b.get(step.id)) for step in a.steps]
    known = {step.id for step in a.steps}
    return pairs + [(None, step) for step in b.steps if step.id not in known]


def _steps(a: LogSide, b: LogSide) -> str:
    rows = []
    for first, second in _paired(a, b):
        step = first or second
        assert step is not None
        if first is None or second is None:
            rows.append([step.id, f"{step.outcome} only in {'a' if second is None else 'b'}", *[""] * len(_UNITS)])
            continue
        outcome = first.outcome if first.outcome == second.outcome else f"{first.outcome}, then {second.outcome}"
        cells = [_change(getattr(first, key), getattr(second, key), unit) for key, unit in _UNITS.items()]
        rows.append([step.id, outcome.replace("_", " "), *cells])
    if not rows:
        return ""
    headers = ["step", "outcome", *_HEADERS.values()]
    used = [k for k in range(len(headers)) if k < 2 or any(row[k] for row in rows)]
    return table([headers[k] for k in used], [[row[k] for k in used] for row in rows])


def _change(a: float | None, b: float | None, unit: str) -> str:
    """`3.21 s`; with the difference, if there is one: `3.21 s +0.04`."""
    if a is None or b is None:
        return "" if a is b else f"{_plain(a, unit)}, {_plain(b, unit)}"
    # The last digits of a sum over thousands of messages depend on the chunks of the file.
    return _plain(a, unit) if abs(b - a) <= ROUNDING * abs(a) else f"{_plain(a, unit)} {b - a:+.2g}"


def _plain(value: float | None, unit: str) -> str:
    return "none" if value is None else f"{value:.4g} {unit}"


def _expectations(a: LogSide, b: LogSide) -> str:
    """Table of the expectations of both logs; equal names are paired in their order."""
    found: dict[tuple[str, int], list[str]] = {}
    for k, side in enumerate((a, b)):
        seen: dict[str, int] = {}
        for expectation in side.verdict.expectations:
            seen[expectation.name] = seen.get(expectation.name, 0) + 1
            found.setdefault((expectation.name, seen[expectation.name]), ["", ""])[k] = _met(expectation)
    rows = [[name, *both] for (name, _), both in found.items()]
    return table(["expectation", "in a", "in b"], rows) if rows else ""


def _met(expectation: ExpectationOutcome) -> str:
    word = expectation.outcome.replace("_", " ")
    if not expectation.distance:
        return word
    size = quantity(expectation.distance, expectation.unit)
    return f"{word}, {size} {'to spare' if expectation.outcome == 'passed' else 'beyond'}"


def _side_object(side: LogSide) -> Json:
    return {
        "task": side.task,
        "robot": side.robot,
        "seed": side.verdict.seed,
        "verdict": side.verdict.verdict,
        "versions": dict(side.versions),
        "simulated_time": number(side.verdict.simulated_time),
        "expectations": [
            {
                "name": expectation.name,
                "outcome": expectation.outcome,
                "margin": number(expectation.margin),
                "unit": expectation.unit,
            }
            for expectation in side.verdict.expectations
        ],
    }


def _pair_object(a: StepMeasures | None, b: StepMeasures | None) -> Json:
    step = a or b
    assert step is not None
    return {"id": step.id, "verb": step.verb, "a": _step_object(a), "b": _step_object(b)}


def _step_object(step: StepMeasures | None) -> Json:
    if step is None:
        return None
    numbers = {key: number(getattr(step, key)) for key in _UNITS}
    return {"outcome": step.outcome, **numbers, "touching": step.touching or None}
