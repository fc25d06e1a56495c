"""What a test in Python gets of a run."""

from __future__ import annotations

from dataclasses import dataclass, fields

from manipcli.report.run_report import RunReport


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
        """With all that the run says."""
        told = {field.name: getattr(run, field.name) for field in fields(RunReport)}
        return JudgedRun(**told, passed=passed, text=text, picture=picture)

    def __repr__(self) -> str:
        """`<passed pour 'runs/pour.mcap'>`: what an assertion shows of it."""
        return f"<{'passed' if self.passed else 'failed'} {self.verdict.task} {self.log!r}>"
