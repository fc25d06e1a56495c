"""What judging gives: one outcome a step, one an expectation, and the verdict over all."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from manipcli.conditions.robustness import EDGE
from manipcli.core.errors import Diagnostic
from manipcli.judge.drawn import Drawn
from manipcli.judge.saturations import Saturations

VerdictWord = Literal["passed", "failed", "error"]
ExpectationWord = Literal["passed", "failed", "not_evaluated"]
StepWord = Literal["done", "failed", "timeout", "interrupted", "not_run"]

INTERRUPTED = "RUN101"
"""The code of the error that says: somebody stopped the run, in the middle of a step or between two."""


def broken_at(watch: str) -> str:
    """How a log begins to tell that the watch of this name ended the run."""
    return f"'{watch}' is broken at "


@dataclass(frozen=True, slots=True)
class Attempt:
    """One attempt at a step: from when to when [s], and how it ended."""

    outcome: StepWord
    started: float
    ended: float | None
    text: str = ""


@dataclass(frozen=True, slots=True)
class StepOutcome:
    """How one step went; times in simulated seconds, None where it never started or ended.

    `planned_duration`: None where it has no plan. `outcome` and `text` are those of the last of `attempts`.
    `tolerated`: it failed, and the task says that it may.
    `replanned`: each time that it was planned again while the task ran, why.
    """

    id: str
    verb: str
    outcome: StepWord
    started: float | None
    ended: float | None
    planned_duration: float | None
    text: str = ""
    attempts: tuple[Attempt, ...] = ()
    tolerated: bool = False
    replanned: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """Its id, and its verb where that does not say it."""
        return self.id if self.id.startswith(self.verb) else f"{self.id} ({self.verb})"

    @property
    def went_wrong(self) -> bool:
        """Whether it was not done though it was its turn, and the task does not say that it may fail."""
        return self.outcome not in ("done", "not_run") and not self.tolerated


@dataclass(frozen=True, slots=True)
class ExpectationOutcome:
    """How one expectation was met. `margin` in `unit` is below 0 when it is not; `at` [s] is its worst moment;
    `relative`: the margin over its tolerance, by which those of other units compare."""

    name: str
    outcome: ExpectationWord
    margin: float | None
    unit: str
    at: float | None
    text: str = ""
    relative: float | None = None

    @property
    def distance(self) -> float:
        """How much in `unit` was to spare, or by how much it is missed; 0 where there is nothing to tell a reader.

        So it is with what never touched, and with what has no unit.
        """
        size = abs(self.margin or 0.0)
        return size if self.unit and size > EDGE else 0.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """The judgement of one recording. `errors`: why there is none, or why it is incomplete or was never made.

    `drawn`: which sample of the task's `vary:` it is of; None: the task as it is written.
    `cuts`: what was asked for more than it can give.
    """

    task: str
    verdict: VerdictWord
    seed: int
    engine: str
    simulated_time: float
    steps: tuple[StepOutcome, ...]
    expectations: tuple[ExpectationOutcome, ...]
    errors: tuple[Diagnostic, ...] = ()
    text: str = ""
    drawn: Drawn | None = None
    cuts: Saturations = field(default_factory=Saturations)

    @property
    def ended_between(self) -> bool:
        """Whether the run ended before its first step or after its last: neither step nor expectation says why."""
        if any(step.went_wrong for step in self.steps):
            return False
        undone = any(step.outcome == "not_run" for step in self.steps)
        return undone or all(one.outcome == "passed" for one in self.expectations)
