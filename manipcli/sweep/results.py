"""Result of one sample of a sweep: its outcome and its margins, as in the journal."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Final, get_args

from manipcli.conditions.robustness import EDGE
from manipcli.judge.verdict import ExpectationOutcome, Verdict
from manipcli.report.suite.suite import CaseReport, CaseWord

FLOOR: Final = -1.0
"""Smallest margin, in tolerances, that the indices of `saltelli` see: a sample that fails by more has failed."""


@dataclass(frozen=True, slots=True)
class Margin:
    """The margin of an expectation: `value` in `unit`, and `relative` to its tolerance; None where not evaluated."""

    name: str
    unit: str
    value: float | None
    relative: float | None
    missed: bool

    @property
    def finite(self) -> float | None:
        """`value`; None also where it is infinite."""
        return self.value if self.value is not None and math.isfinite(self.value) else None

    @property
    def telling(self) -> bool:
        """Whether it says more than that the expectation is met."""
        return self.relative is not None and (self.missed or abs(self.value or 0.0) > EDGE)


@dataclass(frozen=True, slots=True)
class SampleResult:
    """What came of a sample.

    Attributes:
        number: of the sample.
        outcome: as of a test.
        cause: why it did not pass, in one line; "" if it passed.
        step: id of the step that failed, or "".
        simulated: [s] simulated time; None without a run.
        margins: of the expectations, in the order of the task, then of the implied ones.
    """

    number: int
    outcome: CaseWord
    cause: str = ""
    step: str = ""
    simulated: float | None = None
    margins: tuple[Margin, ...] = ()

    @property
    def passed(self) -> bool:
        return self.outcome == "passed"

    @property
    def ran(self) -> bool:
        """Whether the task has a verdict on it."""
        return self.outcome in ("passed", "failed")

    @property
    def broken(self) -> str:
        """Name of the first expectation that is missed, or ""."""
        return next((margin.name for margin in self.margins if margin.missed), "")

    @property
    def smallest(self) -> float:
        """The smallest margin, in tolerances.

        Where a step failed, the margins are those of a task that was not done, so that their size says little: -inf. As
        without a negative margin of a sample that failed. inf: passed, and no margin says more than that.
        """
        known = [margin.relative for margin in self.margins if margin.telling and margin.relative is not None]
        least = min(known, default=math.inf)
        return least if self.passed or (least < 0.0 and not self.step) else -math.inf

    @property
    def score(self) -> float:
        """`smallest` within -1 and 1, so that all samples have a finite number."""
        return min(max(self.smallest, FLOOR), -FLOOR)

    def to_json(self) -> dict[str, object]:
        """The object that `from_json` reads."""
        margins = [[m.name, m.unit, m.value, m.relative, m.missed] for m in self.margins]
        return {
            "sample": self.number,
            "outcome": self.outcome,
            "cause": self.cause,
            "step": self.step,
            "simulated": self.simulated,
            "margins": margins,
        }

    @staticmethod
    def from_json(read: Mapping[str, object]) -> SampleResult:
        """
        Raises:
            KeyError, TypeError, ValueError: the object is not of `to_json`.
        """
        number, margins, outcome = read["sample"], read["margins"], read["outcome"]
        if type(number) is not int or number < 0 or not isinstance(margins, list):
            raise TypeError("not a result")
        word = WORDS[WORDS.index(outcome)]  # ValueError for anything else
        return SampleResult(
            number,
            word,
            str(read["cause"]),
            str(read["step"]),
            _number(read["simulated"]),
            tuple(map(_margin, margins)),
        )


WORDS: Final[tuple[CaseWord, ...]] = get_args(CaseWord)


def _number(read: object) -> float | None:
    if read is None:
        return None
    if not isinstance(read, float) and type(read) is not int:
        raise TypeError("not a number")
    return float(read)


def _margin(read: object) -> Margin:
    if not isinstance(read, list) or len(read) != len(fields(Margin)) or not isinstance(read[4], bool):
        raise TypeError("not a margin")
    return Margin(str(read[0]), str(read[1]), _number(read[2]), _number(read[3]), read[4])


def result_of(report: CaseReport) -> SampleResult:
    """The result in a report of a sample: only what the sample decides, not when and where it was run."""
    number = report.case.sample
    assert number is not None
    verdict = report.run.verdict if report.run is not None else None
    cause = "" if report.passed else _cause(report)
    if verdict is None:
        return SampleResult(number, report.outcome, cause)
    step = next((step.id for step in verdict.steps if step.went_wrong), "")
    return SampleResult(number, report.outcome, cause, step, verdict.simulated_time, _margins(verdict))


def _cause(report: CaseReport) -> str:
    text = next((trouble.message for trouble in report.troubles), report.text) or report.outcome
    if report.outcome in ("crashed", "hung"):
        text = text.partition(";")[0]  # the rest depends on when the process was last heard
    return " ".join(text.split())


def _margins(verdict: Verdict) -> tuple[Margin, ...]:
    seen = Counter[str]()

    def named(outcomes: Iterable[ExpectationOutcome]) -> Iterable[Margin]:
        for each in outcomes:
            seen[each.name] += 1
            name = each.name if seen[each.name] == 1 else f"{each.name} #{seen[each.name]}"
            yield Margin(name, each.unit, each.margin, each.relative, each.missed)

    return (*named(verdict.expectations), *named(verdict.implied))
