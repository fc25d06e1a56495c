"""Result of `run --engines`: the reports of the runs and their comparison."""

from __future__ import annotations

from dataclasses import dataclass

from manipcli.core.errors import ExitCode
from manipcli.judge.agreement import Agreement
from manipcli.report.run_report import RunReport, exit_code


@dataclass(frozen=True, slots=True)
class ComparedRuns:
    """The runs of a task.

    Attributes:
        agreement: their comparison.
        reports: of the runs, in its order.
    """

    agreement: Agreement
    reports: tuple[RunReport, ...]

    @property
    def exit_code(self) -> ExitCode:
        """0 if all runs passed and agree, else that of a failed verdict."""
        codes = {exit_code(report.verdict) for report in self.reports}
        if ExitCode.INTERNAL in codes:
            return ExitCode.INTERNAL
        return ExitCode.PASSED if codes == {ExitCode.PASSED} and self.agreement.agrees else ExitCode.FAILED
