"""What one run gives its caller: the verdict on its log, and how long the run took."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path

from manipcli.core.errors import Diagnostic, ExitCode
from manipcli.judge.verdict import INTERRUPTED, Verdict


@dataclass(frozen=True, slots=True)
class Timing:
    """Wall time of each part of a run [s]."""

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
        verdict: read from the log alone.
        timing: wall time of each stage.
        log: path of the log, as text; None where nothing was run, or it was not kept.
        warnings: what was doubted before the run began: about its files, and about gains.
        meshes: files of the robot and of the scene by the URIs that the log has for them, to draw the run with.
    """

    verdict: Verdict
    timing: Timing
    log: str | None = None
    warnings: tuple[Diagnostic, ...] = ()
    meshes: Mapping[str, Path] = field(default_factory=dict)

    @property
    def wall_time(self) -> float:
        """[s] of all stages."""
        return self.timing.total

    @property
    def real_time_factor(self) -> float | None:
        """Simulated time over the wall time of the simulation; None where nothing was simulated."""
        return self.verdict.simulated_time / self.timing.simulate if self.timing.simulate else None


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedRun(RunReport):
    """A run, and what `manipcli test` says of it.

    Attributes:
        passed: whether all that was expected is met, and nothing is worse than the baseline.
        text: what went wrong and what did not, and where log and picture are.
        picture: path of the picture of what went wrong, as text; None where nothing did.
    """

    passed: bool
    text: str
    picture: str | None

    @staticmethod
    def of(run: RunReport, *, passed: bool, text: str, picture: str | None) -> JudgedRun:
        told = {field.name: getattr(run, field.name) for field in fields(RunReport)}
        return JudgedRun(**told, passed=passed, text=text, picture=picture)

    def __repr__(self) -> str:
        """`<passed pour 'runs/pour.mcap'>`: what an assertion shows of it."""
        return f"<{'passed' if self.passed else 'failed'} {self.verdict.task} {self.log!r}>"


def exit_code(verdict: Verdict) -> ExitCode:
    """What a command returns that ends with this verdict."""
    if verdict.verdict == "passed":
        return ExitCode.PASSED
    if verdict.verdict == "failed":
        return ExitCode.FAILED
    interrupted = any(finding.code == INTERRUPTED for finding in verdict.errors)
    return ExitCode.INTERRUPTED if interrupted else ExitCode.INTERNAL
