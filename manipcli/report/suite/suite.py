"""What many runs give: a case each, what came of it, and where to look if it did not pass."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from manipcli.core.errors import Diagnostic, ExitCode, Place
from manipcli.judge.drawn import Drawn
from manipcli.judge.verdict import ExpectationOutcome
from manipcli.report.run_report import RunReport

CaseWord = Literal["passed", "failed", "error", "invalid", "crashed", "hung"]
"""`error`: there is no verdict, and neither the file nor a crash is why; `invalid`: nothing was run."""


@dataclass(frozen=True, slots=True)
class Case:
    """One run of one task.

    Attributes:
        file: the task file, as it is shown.
        task: its name; of a file that cannot be read, that of the file.
        sample: of its `vary:`; None for the task as it is written.
        tags: of the task, and `engine_<name>`.
        varied: whether the task has a `vary:`.
        findings: why the file cannot be read.
        line: of the key `task`, from 1.
    """

    file: str
    task: str
    sample: int | None = None
    tags: tuple[str, ...] = ()
    varied: bool = False
    findings: tuple[Diagnostic, ...] = ()
    line: int = 1

    @property
    def name(self) -> str:
        """`pour`, `pour[17]`."""
        return self.task if self.sample is None else f"{self.task}[{self.sample}]"

    @property
    def id(self) -> str:
        """`tasks/pour.yaml::pour[17]`."""
        return f"{self.file}::{self.name}"


@dataclass(frozen=True, slots=True)
class Trouble:
    """One reason why a case did not pass. `at` [s] of the run; None where it has no time."""

    message: str
    place: Place | None = None
    at: float | None = None


@dataclass(frozen=True, slots=True)
class CaseReport:
    """What came of a case.

    Attributes:
        text: why it did not pass, in a line, where no step or expectation says it.
        run: None where there is no verdict.
        findings: why nothing was run.
        troubles: what went wrong, the first cause first.
        warnings: what was doubted before the run began.
        duration: wall time [s], without what it took to draw and write about the run.
        log, picture, page, output: files that were kept; `output` is what a process said that did not come to its end.
        command: what does the same again.
        notes: what could not be made of it.
    """

    case: Case
    outcome: CaseWord
    duration: float
    command: str
    text: str = ""
    run: RunReport | None = None
    findings: tuple[Diagnostic, ...] = ()
    troubles: tuple[Trouble, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    log: str | None = None
    picture: str | None = None
    page: str | None = None
    output: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        return self.outcome == "passed"

    @property
    def drawn(self) -> Drawn | None:
        """Of a sample, its values."""
        return self.run.verdict.drawn if self.run is not None else None

    @property
    def tightest(self) -> ExpectationOutcome | None:
        """The expectation with the smallest margin over its tolerance; None where there is none.

        What is met without a margin to speak of, as what never touched, counts only where there is nothing else.
        """
        judged = self.run.verdict.expectations if self.run is not None else ()
        known = [one for one in judged if one.relative is not None]
        return min(known, key=lambda one: (one.outcome == "passed", not one.distance, one.relative), default=None)


@dataclass(frozen=True, slots=True)
class Suite:
    """All of it.

    Attributes:
        total: how many there were to run.
        stopped: why some were not; `undone`: which.
        notes: what else to know.
    """

    reports: tuple[CaseReport, ...]
    total: int
    jobs: int
    duration: float
    stopped: Literal["", "interrupted", "first failure"] = ""
    notes: tuple[str, ...] = ()
    undone: tuple[Case, ...] = ()

    @property
    def exit_code(self) -> ExitCode:
        """As documented: of several, the first of interrupted, invalid, failed."""
        words = {report.outcome for report in self.reports}
        if self.stopped == "interrupted":
            return ExitCode.INTERRUPTED
        if not self.total:
            return ExitCode.NOTHING_TO_RUN
        if "invalid" in words:
            return ExitCode.USAGE
        return ExitCode.FAILED if words - {"passed"} else ExitCode.PASSED


def signal_name(number: int) -> str:
    """`signal 11 (SIGSEGV)`."""
    try:
        return f"signal {number} ({signal.Signals(number).name})"
    except ValueError:
        return f"signal {number}"


def troubles_of(findings: Sequence[Diagnostic]) -> tuple[Trouble, ...]:
    """Why a file cannot be used, as troubles: its errors."""
    return tuple(
        Trouble(f"{one.severity}[{one.code}]: {one.message}{f' (hint: {one.hint})' if one.hint else ''}", one.place)
        for one in findings
        if one.severity == "error"
    )


def doubts_of(findings: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """What there is to say of a file that keeps nobody from using it."""
    return tuple(one for one in findings if one.severity != "error")
