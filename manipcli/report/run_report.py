"""Result of one run: the verdict on its log and the wall time of each stage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path

from manipcli.core.errors import Diagnostic, ExitCode
from manipcli.judge.verdict import INTERRUPTED, Verdict


@dataclass(frozen=True, slots=True)
class Timing:
    """Wall time of each stage of a run [s]."""

    load: float = 0.0
    plan: float = 0.0
    simulate: float = 0.0
    judge: float = 0.0

    @property
    def total(self) -> float:
        """[s]."""
        return self.load + self.plan + self.simulate + self.judge


@dataclass(frozen=True, slots=True)
class RunReport:
    """One run.

    Attributes:
        verdict: verdict, judged from the log alone.
        timing: wall time of each stage.
        log: path of the log; None if nothing was run or the log was not kept.
        warnings: warnings from before the run, about its files and gains.
        log_size: size of the log [byte]; None if it is unknown.
        meshes: mesh files of robot and scene by their URI in the log, to draw the run.
    """

    verdict: Verdict
    timing: Timing
    log: str | None = None
    warnings: tuple[Diagnostic, ...] = ()
    meshes: Mapping[str, Path] = field(default_factory=dict)
    log_size: int | None = None

    @property
    def wall_time(self) -> float:
        """Sum over all stages [s]."""
        return self.timing.total

    @property
    def real_time_factor(self) -> float | None:
        """Simulated time over the wall time of the simulation; None if nothing was simulated."""
        return self.verdict.simulated_time / self.timing.simulate if self.timing.simulate else None


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedRun(RunReport):
    """A run with its test result.

    Attributes:
        passed: whether all expectations are met and no margin is worse than the baseline.
        text: causes, met expectations, and the paths of log and picture.
        picture: path of the picture of the failure; None if the run passed.
    """

    passed: bool
    text: str
    picture: str | None

    @staticmethod
    def of(run: RunReport, *, passed: bool, text: str, picture: str | None) -> JudgedRun:
        values = {field.name: getattr(run, field.name) for field in fields(RunReport)}
        return JudgedRun(**values, passed=passed, text=text, picture=picture)

    def __repr__(self) -> str:
        """`<passed pour 'runs/pour.mcap'>`, as shown by a failed assertion."""
        return f"<{'passed' if self.passed else 'failed'} {self.verdict.task} {self.log!r}>"


def exit_code(verdict: Verdict) -> ExitCode:
    """Exit code of a command that ends with this verdict."""
    if verdict.verdict == "passed":
        return ExitCode.PASSED
    if verdict.verdict == "failed":
        return ExitCode.FAILED
    interrupted = any(finding.code == INTERRUPTED for finding in verdict.errors)
    return ExitCode.INTERRUPTED if interrupted else ExitCode.INTERNAL
