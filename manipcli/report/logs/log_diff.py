"""Two logs beside each other: what they were made from, how the steps went, what was expected, where they part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from manipcli.core.text import number_of
from manipcli.judge.measures.step_measures import StepMeasures
from manipcli.judge.verdict import ExpectationOutcome, Verdict
from manipcli.record.channels import JOINT_STATES, TF
from manipcli.record.foreign.compare import Comparison
from manipcli.record.read.compare_entries import EntryDifference
from manipcli.report.json import Json, dumps, number, plain
from manipcli.report.logs.comparison import (
    Names,
    counted,
    entries_lines,
    first_text,
    messages_object,
    topics_table,
)
from manipcli.report.quantity import quantity
from manipcli.report.table import table
from manipcli.report.text import FAIL, PASS

_NAMES: Names = ("in a", "in b")
_UNITS = {"duration": "s", "turned": "rad", "slid": "m", "tool": "m", "force": "N", "work": "J"}
"""Numbers of a step, and their units."""
_HEADERS = {
    "duration": "duration",
    "turned": "joints turned",
    "slid": "joints slid",
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
    """Two logs.

    Attributes:
        a, b: their paths.
        sides: None where one was not written by manipcli.
        entries: metadata and attachments that differ: what they were made from.
        messages: of all topics.
        notes: what cannot be compared, and why.
        tolerance: of numbers in messages.
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
        """Whether the same happened: in every message, and by the verdict on it."""
        return self.messages.same and bool(self.messages.topics) and self._judged_alike

    @property
    def _judged_alike(self) -> bool:
        if self.sides is None:
            return True
        a, b = (side.verdict for side in self.sides)
        if (a.task, a.verdict) != (b.task, b.verdict):
            return False
        steps = [[(step.id, step.outcome) for step in one.steps] for one in (a, b)]
        expected = [[(each.name, each.outcome) for each in one.expectations] for one in (a, b)]
        return steps[0] == steps[1] and expected[0] == expected[1]


def render_text(made: LogDiff) -> str:
    """What they were made from, the steps, the expectations, where they begin to differ, and the answer."""
    lines = [f"a: {made.a}{_about(made, 0)}", f"b: {made.b}{_about(made, 1)}", ""]
    lines += [f"note: {note}" for note in made.notes]
    lines += [f"made from: {line}" for line in entries_lines(made.entries, _NAMES)]
    lines += [""] if lines[-1] else []
    if made.sides is not None:
        for each in (_steps(*made.sides), _expectations(*made.sides)):
            lines += [each, ""] if each else []
    unlike = [topic for topic in made.messages.topics if not topic.same]
    if unlike:
        shown = topics_table(unlike[:MOST_TOPICS], _NAMES)
        lines += [shown, ""]
    first = made.messages.first
    if first is not None:
        lines.append(f"{FAIL} first difference: {first_text(first, _NAMES)}")
    for topic in unlike:
        if topic.name in (JOINT_STATES, TF) and topic.first is not None and topic.first != first:
            lines.append(f"{FAIL} {topic.name} differs first: {first_text(topic.first, _NAMES)}")
    lines.append(_answer(made))
    return "\n".join(lines)


def _answer(made: LogDiff) -> str:
    if not made.messages.topics:
        return f"{FAIL} different"
    if not made.messages.same:
        more = f", numbers by more than {made.tolerance:g}" if made.tolerance else ""
        return f"{FAIL} different{more}: {counted(made.messages)}"
    within = f" within {made.tolerance:g}" if made.tolerance else ""
    if made.same:
        judged = ", and the verdict on them" if made.sides else ""
        return f"{PASS} no difference{within}: {number_of(made.messages.messages, 'message')}{judged}"
    return f"{FAIL} different: the messages are the same{within}, the verdict on them is not"


def render_json(made: LogDiff) -> str:
    """The same as one object; numbers are SI."""
    return dumps(
        {
            "a": made.a,
            "b": made.b,
            "same": made.same,
            "tolerance": made.tolerance,
            "notes": list(made.notes),
            "made_from": plain(made.entries),
            "runs": None if made.sides is None else [_side_object(side) for side in made.sides],
            "steps": [] if made.sides is None else [_pair_object(a, b) for a, b in _paired(*made.sides)],
            **messages_object(made.messages),
        }
    )


def _about(made: LogDiff, k: int) -> str:
    if made.sides is None:
        return ""
    side = made.sides[k]
    versions = ", ".join(f"{name} {version}" for name, version in side.versions.items())
    return f"  ({side.task} {side.verdict.verdict}, robot {side.robot}, seed {side.verdict.seed}, {versions})"


def _paired(a: LogSide, b: LogSide) -> list[tuple[StepMeasures | None, StepMeasures | None]]:
    """Steps of one id, in the order of the first log; then those of the second alone."""
    of_b = {step.id: step for step in b.steps}
    pairs: list[tuple[StepMeasures | None, StepMeasures | None]] = [(one, of_b.get(one.id)) for one in a.steps]
    known = {one.id for one in a.steps}
    return pairs + [(None, one) for one in b.steps if one.id not in known]


def _steps(a: LogSide, b: LogSide) -> str:
    rows = []
    for one, other in _paired(a, b):
        step = one or other
        assert step is not None
        if one is None or other is None:
            rows.append([step.id, f"{step.outcome} in {'a' if other is None else 'b'} alone", *[""] * len(_UNITS)])
            continue
        outcome = one.outcome if one.outcome == other.outcome else f"{one.outcome}, then {other.outcome}"
        cells = [_change(getattr(one, key), getattr(other, key), unit) for key, unit in _UNITS.items()]
        rows.append([step.id, outcome.replace("_", " "), *cells])
    if not rows:
        return ""
    headers = ["step", "outcome", *_HEADERS.values()]
    used = [k for k in range(len(headers)) if k < 2 or any(row[k] for row in rows)]
    return table([headers[k] for k in used], [[row[k] for k in used] for row in rows])


def _change(a: float | None, b: float | None, unit: str) -> str:
    """`3.21 s`, where it differs with how much is added: `3.21 s +0.04`."""
    if a is None or b is None:
        return "" if a is b else f"{_plain(a, unit)}, {_plain(b, unit)}"
    # Sums of thousands of numbers differ in their last digits with the chunks of the files.
    return _plain(a, unit) if abs(b - a) <= ROUNDING * abs(a) else f"{_plain(a, unit)} {b - a:+.2g}"


def _plain(value: float | None, unit: str) -> str:
    return "none" if value is None else f"{value:.4g} {unit}"


def _expectations(a: LogSide, b: LogSide) -> str:
    """The first of a name beside the first of that name, and so on."""
    found: dict[tuple[str, int], list[str]] = {}
    for k, side in enumerate((a, b)):
        seen: dict[str, int] = {}
        for one in side.verdict.expectations:
            seen[one.name] = seen.get(one.name, 0) + 1
            found.setdefault((one.name, seen[one.name]), ["", ""])[k] = _met(one)
    rows = [[name, *both] for (name, _), both in found.items()]
    return table(["expectation", "in a", "in b"], rows) if rows else ""


def _met(one: ExpectationOutcome) -> str:
    word = one.outcome.replace("_", " ")
    if not one.distance:
        return word
    return f"{word}, {quantity(one.distance, one.unit)} {'to spare' if one.outcome == 'passed' else 'beyond'}"


def _side_object(side: LogSide) -> Json:
    return {
        "task": side.task,
        "robot": side.robot,
        "seed": side.verdict.seed,
        "verdict": side.verdict.verdict,
        "versions": dict(side.versions),
        "simulated_time": number(side.verdict.simulated_time),
        "expectations": [
            {"name": one.name, "outcome": one.outcome, "margin": number(one.margin), "unit": one.unit}
            for one in side.verdict.expectations
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
