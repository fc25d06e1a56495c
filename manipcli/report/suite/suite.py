"""Results of many runs: the case, outcome, causes and kept files of each."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

from manipcli.core.errors import Diagnostic, ExitCode, Place
from manipcli.judge.agreement import Agreement
from manipcli.judge.drawn import Drawn
from manipcli.judge.measured_run import MeasuredRun, Variant
from manipcli.judge.verdict import ExpectationOutcome
from manipcli.report.run_report import RunReport

AGREEMENT: Final = "agreement"
"""In the id of the case that compares runs: `tasks/pour.yaml::pour[agreement]`."""
ENGINE: Final = "engine_"
"""Beginning of the tag that names the engine."""

CaseWord = Literal["passed", "failed", "differs", "error", "invalid", "crashed", "hung"]
"""`differs`: the runs in several engines or steps do not agree;
`error`: no verdict, for a reason other than the file or a crash; `invalid`: the file is invalid, nothing was run."""


@dataclass(frozen=True, slots=True)
class Case:
    """A run of a task.

    Attributes:
        file: path of the task file, as shown.
        task: name of the task; the name of the file if it cannot be read.
        sample: number of the sample of its `vary:`; None for the task as written.
        tags: tags of the task, and `engine_<name>`.
        varied: whether the task has a `vary:`.
        variant: the engine and step of one of several runs of `--engines`; None: those of the task.
        compared: the runs whose agreement this case tests, instead of a run; empty for a run.
        findings: errors of the file.
        line: line of the key `task`, from 1.
    """

    file: str
    task: str
    sample: int | None = None
    tags: tuple[str, ...] = ()
    varied: bool = False
    findings: tuple[Diagnostic, ...] = ()
    line: int = 1
    variant: Variant | None = None
    compared: tuple[Variant, ...] = ()

    @property
    def kind(self) -> str:
        """`17`, `mujoco`, `17-mujoco`, `agreement`; "" for the task as written."""
        words = [] if self.sample is None else [str(self.sample)]
        words += [AGREEMENT] if self.compared else [] if self.variant is None else [self.variant.name]
        return "-".join(words)

    @property
    def engine(self) -> str:
        """The engine by its tag, the last one; "" without one."""
        return next((tag.removeprefix(ENGINE) for tag in reversed(self.tags) if tag.startswith(ENGINE)), "")

    @property
    def name(self) -> str:
        """`pour`, `pour[17]`, `pour[mujoco]`."""
        return f"{self.task}[{self.kind}]" if self.kind else self.task

    @property
    def runs(self) -> tuple[Case, ...]:
        """The cases that must run for this one: those of an agreement, or itself."""
        return tuple(replace(self, variant=variant, compared=()) for variant in self.compared) or (self,)

    @property
    def id(self) -> str:
        """`tasks/pour.yaml::pour[17]`."""
        return f"{self.file}::{self.name}"


@dataclass(frozen=True, slots=True)
class Trouble:
    """One reason why a case did not pass. `at` is in s of the run; None if it has no time."""

    message: str
    place: Place | None = None
    at: float | None = None


@dataclass(frozen=True, slots=True)
class CaseReport:
    """Result of a case.

    Attributes:
        text: why the case did not pass, in one line, if no step or expectation is the cause.
        run: the run; None without a verdict.
        findings: errors that prevented the run.
        troubles: what went wrong, the first cause first.
        warnings: warnings from before the run.
        duration: wall time [s], without the pictures and reports.
        log, picture, page, output: kept files; `output` is the output of a process that crashed or hung.
        command: shell command that reproduces the case.
        notes: files that could not be written.
        measured: numbers of a run with a variant.
        agreement: of a case that compares runs; None where one of them has no verdict.
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
    measured: MeasuredRun | None = None
    agreement: Agreement | None = None

    @property
    def passed(self) -> bool:
        return self.outcome == "passed"

    @property
    def drawn(self) -> Drawn | None:
        """Drawn values of a sample; None for the task as written."""
        return self.run.verdict.drawn if self.run is not None else None

    @property
    def tightest(self) -> ExpectationOutcome | None:
        """The expectation with the smallest margin relative to its tolerance; None without a margin.

        An expectation that is met with a zero margin is taken only if there is no other.
        """
        judged = self.run.verdict.expectations if self.run is not None else ()
        known = [expectation for expectation in judged if expectation.relative is not None]
        return min(
            known,
            key=lambda expectation: (expectation.outcome == "passed", not expectation.distance, expectation.relative),
            default=None,
        )


@dataclass(frozen=True, slots=True)
class Suite:
    """Results of all cases.

    Attributes:
        total: number of cases to run.
        stopped: why cases were not run.
        undone: the cases that were not run.
        notes: further remarks.
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
        """Exit code: interrupted before invalid before failed."""
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
    """The errors among the findings, as troubles."""
    return tuple(
        Trouble(
            f"{finding.severity}[{finding.code}]: {finding.message}"
            + (f" (hint: {finding.hint})" if finding.hint else ""),
            finding.place,
        )
        for finding in findings
        if finding.severity == "error"
    )


def warnings_of(findings: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The findings that are not errors."""
    return tuple(finding for finding in findings if finding.severity != "error")
