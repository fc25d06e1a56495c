"""Agreement of several runs of one task: in several engines, and at half the physics step.

Runs in several engines agree if every step and expectation has the same outcome in all of them, and no number differs
by more than `agree:` of the task allows. A run and the run of the same engine at half the step agree if the outcomes
are the same: a verdict that changes with the step is an artefact of the integration.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from manipcli.core.errors import Diagnostic, Loc, Place
from manipcli.judge.compared_numbers import Kind, Row, by_name, margin_of, rows_of
from manipcli.judge.measured_run import MeasuredRun, Number
from manipcli.judge.verdict import StepOutcome
from manipcli.spec.source.tree import dotted

Cause = Literal["engines", "step", "limit"]
"""`engines`: the runs of different engines differ; `step`: the run at half the step has another outcome; `limit`: a
limit of `agree:` has another unit than its margin, which only the runs show."""
LIMITS: Final[Mapping[Kind, str]] = {
    "duration": "duration",
    "step_duration": "duration",
    "slip": "slip",
    "grasp_force": "force",
    "contact_force": "contact_force",
}
"""The fields of `agree:` that limit numbers other than margins."""


@dataclass(frozen=True, slots=True)
class Disagreement:
    """One thing in which two runs differ.

    Attributes:
        cause: what disagrees.
        kind: `verdict`, `step`, `expectation`: its outcome; else the number.
        name: of the step, the expectation, the body; "" for the whole task.
        runs: names of the two runs.
        outcomes: in the two runs; empty for a number.
        texts: the reason of each outcome, "" without one; for `limit`, why it cannot be used.
        values: numbers of the two runs; None where there are none.
        allowed: the allowed difference of a number; None without a limit.
        place: in the task file.
    """

    cause: Cause
    kind: Kind | Literal["verdict", "step", "expectation"]
    name: str
    runs: tuple[str, str]
    outcomes: tuple[str, ...] = ()
    texts: tuple[str, ...] = ()
    values: tuple[Number | None, ...] = ()
    allowed: float | None = None
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Agreement:
    """The comparison of the runs of a task: at least two runs."""

    task: str
    runs: tuple[MeasuredRun, ...]
    rows: tuple[Row, ...]
    disagreements: tuple[Disagreement, ...]

    @property
    def agrees(self) -> bool:
        return not self.disagreements

    @property
    def judged(self) -> bool:
        """Whether any run did a step or has an evaluated expectation; otherwise there is nothing to compare."""
        verdicts = [run.verdict for run in self.runs]
        done = any(step.outcome == "done" for verdict in verdicts for step in verdict.steps)
        return done or any(each.outcome != "not_evaluated" for verdict in verdicts for each in verdict.expectations)

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Limits of `agree:` without effect: fewer than two engines have the number; empty for a single engine."""
        return tuple(_ineffective(self)) if self.judged and len(self.engines) > 1 else ()

    @property
    def engines(self) -> tuple[MeasuredRun, ...]:
        """The runs at the step of the task, one per engine."""
        return tuple(run for run in self.runs if not run.variant.half_step)


def compare(runs: Sequence[MeasuredRun]) -> Agreement:
    """The comparison of runs of the same task.

    Args:
        runs: at least two; one per engine at the step of the task, each optionally with a run at half the step.
    """
    whole = [run for run in runs if not run.variant.half_step]
    halved = {run.variant.engine: run for run in runs if run.variant.half_step}
    rows = tuple(rows_of(runs))
    first = whole[0]
    found = [flip for run in whole[1:] for flip in _flips("engines", first, run)]
    flipped = {flip.name for flip in found if flip.kind == "expectation"}
    found += [
        _beyond(row, runs, _place(first, row))
        for row in rows
        if not row.agrees and not row.misfit and not (row.kind == "margin" and row.name in flipped)
    ]
    found += [_unusable(row, whole) for row in rows if row.misfit]
    for run in whole:
        if run.variant.engine in halved:
            found += _flips("step", run, halved[run.variant.engine])
    return Agreement(first.verdict.task, tuple(runs), rows, tuple(found))


def _flips(cause: Cause, a: MeasuredRun, b: MeasuredRun) -> Iterator[Disagreement]:
    """Different outcomes of two runs: the first step, else the expectations, else the verdict."""
    names = (a.name, b.name)
    steps = by_name(b.verdict.steps, lambda step: step.id)
    for step in a.verdict.steps:
        other = steps.get(step.id)
        if other is not None and _word(step) != _word(other):
            outcomes, texts = (step.outcome, other.outcome), (step.text, other.text)
            yield Disagreement(cause, "step", step.id, names, outcomes, texts, place=_of_step(a, step.id))
            return
    expectations = by_name(b.verdict.expectations, lambda expectation: expectation.name)
    differs = False
    for k, mine in enumerate(a.verdict.expectations):
        its = expectations.get(mine.name)
        if its is not None and mine.outcome != its.outcome:
            differs = True
            yield Disagreement(
                cause,
                "expectation",
                mine.name,
                names,
                (mine.outcome, its.outcome),
                (mine.text, its.text),
                (margin_of(mine), margin_of(its)),
                place=_of_expectation(a, k),
            )
    if not differs and a.verdict.verdict != b.verdict.verdict:
        words, reasons = (a.verdict.verdict, b.verdict.verdict), (a.verdict.text, b.verdict.text)
        yield Disagreement(cause, "verdict", "", names, words, reasons, place=a.places.get(("task",)))


def _word(step: StepOutcome) -> str:
    """The outcome; a tolerated failure has no effect on the verdict."""
    return "done" if step.tolerated else step.outcome


def _beyond(row: Row, runs: Sequence[MeasuredRun], place: Place | None) -> Disagreement:
    """The disagreement of a number: its smallest and its largest value, in the order of the runs."""
    known = [
        (value.value, k)
        for k, (value, run) in enumerate(zip(row.values, runs, strict=True))
        if value is not None and not run.variant.half_step
    ]
    a, b = sorted((min(known)[1], max(known)[1]))
    names, values = (runs[a].name, runs[b].name), (row.values[a], row.values[b])
    return Disagreement("engines", row.kind, row.name, names, values=values, allowed=row.allowed, place=place)


def _unusable(row: Row, runs: Sequence[MeasuredRun]) -> Disagreement:
    """A limit in another unit: the margins are not compared, so the runs do not agree."""
    place = runs[0].places.get(("agree", "margins", row.name))
    names = (runs[0].name, runs[1].name)
    return Disagreement("limit", row.kind, row.name, names, texts=(row.misfit,), place=place)


def _ineffective(agreement: Agreement) -> Iterator[Diagnostic]:
    """A warning for each limit that no number was compared with."""
    agree, places = agreement.runs[0].agree, agreement.runs[0].places
    compared = {(row.kind, row.name) for row in agreement.rows if row.difference is not None}
    kinds = {kind for kind, _ in compared}
    limits: list[tuple[Loc, bool, str]] = [
        (("agree", "margins", name), ("margin", name) in compared, f"a margin of '{name}'") for name in agree.margins
    ]
    if agree.margin is not None:
        limits.append((("agree", "margin"), "margin" in kinds, "a margin"))
    if agree.duration is not None:
        limits.append((("agree", "duration"), "duration" in kinds, "a duration"))
    of_kinds: tuple[tuple[Kind, str], ...] = (
        ("slip", "a slip in the hand"), ("grasp_force", "a grasp"), ("contact_force", "a contact"),
    )  # fmt: skip
    for kind, what in of_kinds:
        key = LIMITS[kind]
        if getattr(agree, key) is not None:
            limits.append((("agree", key), kind in kinds, what))
    for loc, used, what in limits:
        if not used:
            message = f"{dotted(loc)} has no effect: fewer than two engines have {what}"
            yield Diagnostic("TASK248", message, places.get(loc), severity="warning")


def _place(run: MeasuredRun, row: Row) -> Place | None:
    """Where the expectation or step of a number is written; the limit of a grasp, else the task."""
    if row.kind == "margin":
        names = [expectation.name for expectation in run.verdict.expectations]
        return _of_expectation(run, names.index(row.name)) if row.name in names else None
    if row.kind == "step_duration":
        return _of_step(run, row.name)
    key = LIMITS.get(row.kind, "duration")
    return run.places.get(("agree", key), run.places.get(("task",)))


def _of_step(run: MeasuredRun, name: str) -> Place | None:
    numbers = [step.id for step in run.verdict.steps]
    return run.places.get(("steps", numbers.index(name))) if name in numbers else None


def _of_expectation(run: MeasuredRun, k: int) -> Place | None:
    return run.places.get(("judged", k))
