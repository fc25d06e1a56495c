"""The text of a disagreement: what differs, in which runs, both numbers and the allowed difference."""

from __future__ import annotations

import math

from manipcli.core.errors import Place
from manipcli.core.text import number_of
from manipcli.judge.agreement import Agreement, Disagreement
from manipcli.judge.compared_numbers import Kind, Row
from manipcli.judge.measured_run import Number
from manipcli.report.display_quantity import quantity

CAUSES = {
    "engines": "engines disagree",
    "step": "the verdict depends on the step",
    "limit": "a limit cannot be used",
}
NAMES: dict[Kind, str] = {
    "margin": "the margin of '{}'",
    "duration": "the duration of the task",
    "step_duration": "the duration of step '{}'",
    "slip": "the slip of '{}' in the hand",
    "rotation": "the rotation of '{}' in the hand",
    "grasp_force": "the peak force of the grasp of '{}'",
    "contact_force": "the peak contact force in step '{}'",
}


def describe(found: Disagreement, *, file: str | None = None) -> str:
    """One line with its place: `tasks/pour.yaml:9:5: engines disagree: ...`; `file` replaces the name of the file."""
    place = found.place
    if place is not None and file is not None:
        place = Place(file, place.line, place.column)
    return f"{place}: {message(found)}" if place is not None else message(found)


def message(found: Disagreement) -> str:
    """`engines disagree: expectation 'inside' passed with 12 mm to spare in pybullet, failed by 3 mm in mujoco`."""
    return f"{CAUSES[found.cause]}: {_difference(found)}"


def _difference(found: Disagreement) -> str:
    if found.cause == "limit":
        return found.texts[0]
    a, b = found.runs
    if found.outcomes:
        values = found.values or (None, None)
        texts = found.texts or ("", "")
        mine, its = (
            _outcome(outcome, value, text) for outcome, value, text in zip(found.outcomes, values, texts, strict=True)
        )
        what = {"verdict": "the task", "step": f"step '{found.name}'", "expectation": f"'{found.name}'"}[found.kind]
        return f"{what} {mine} with {a}, {its} with {b}"
    return _numbers(found, a, b)


def _numbers(found: Disagreement, a: str, b: str) -> str:
    assert found.kind in NAMES, "other disagreements have outcomes"
    mine, its = found.values
    assert mine is not None and its is not None, "compared numbers are known"
    what = NAMES[found.kind].format(found.name)
    if mine.unit != its.unit:
        return f"{what} is {shown(mine)} with {a} and {shown(its)} with {b}; they are not comparable"
    difference = quantity(abs(mine.value - its.value), mine.unit)
    allowed = "" if found.allowed is None else f"; `agree:` allows {quantity(found.allowed, mine.unit)}"
    return f"{what} is {shown(mine)} with {a} and {shown(its)} with {b}: they differ by {difference}{allowed}"


def _outcome(outcome: str, value: Number | None, text: str) -> str:
    """`passed with 12 mm to spare`, `failed by 3 mm`, `timeout (text)`."""
    word = {"not_evaluated": "not evaluated", "timeout": "timed out", "not_run": "not run"}.get(outcome, outcome)
    if outcome in ("passed", "failed") and value is not None and value.unit:
        size = quantity(abs(value.value), value.unit)
        return f"{word} with {size} to spare" if outcome == "passed" else f"{word} by {size}"
    return f"{word} ({text})" if text and outcome not in ("passed", "done") else word


def shown(value: Number | None) -> str:
    """A number for a table; a time with two digits."""
    if value is None:
        return "-"
    return f"{value.value:.2f} s" if value.unit == "s" else quantity(value.value, value.unit)


def difference_of(row: Row) -> str:
    """The difference of a row for a table."""
    if row.difference is None:
        return "-"
    return shown(Number(row.difference, row.unit)) if math.isfinite(row.difference) else "other unit"


def allowed_of(row: Row) -> str:
    """The allowed difference of a row for a table."""
    if row.misfit:
        return "other unit"
    return "any" if row.allowed is None else shown(Number(row.allowed, row.unit))


def summary(agreement: Agreement) -> str:
    """The result in one line: `pybullet and mujoco agree: all passed`, or the first disagreement."""
    if not agreement.agrees:
        first, more = agreement.disagreements[0], len(agreement.disagreements) - 1
        return message(first) + (f" (and {more} more)" if more else "")
    names = [run.name for run in agreement.runs]
    if not agreement.judged:
        return f"{', '.join(names[:-1])} and {names[-1]} are not compared: no step was done in any run"
    return f"{', '.join(names[:-1])} and {names[-1]} agree: all {agreement.runs[0].verdict.verdict}"


def short_summary(agreement: Agreement) -> str:
    """The result in one line below the disagreements: `engines disagree: 2 differences`."""
    if agreement.agrees:
        return summary(agreement)
    differing = [CAUSES[found.cause] for found in agreement.disagreements if found.cause != "limit"]
    unusable = len(agreement.disagreements) - len(differing)
    parts = []
    if differing:
        parts.append(f"{', and '.join(dict.fromkeys(differing))}: {number_of(len(differing), 'difference')}")
    if unusable:
        parts.append(f"not compared: {number_of(unusable, 'margin')} with an unusable limit")
    return "; ".join(parts)
