"""Samples run by processes of this machine, as those of `manipcli test --samples`."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from contextlib import closing
from pathlib import Path
from typing import Final, Literal, Protocol

from manipcli.batch.forks import ForkPool
from manipcli.batch.job import Beat, Job
from manipcli.batch.process import run_jobs
from manipcli.core.errors import Diagnostic, ManipcliError
from manipcli.report.suite.suite import CaseReport
from manipcli.sweep.results import SampleResult, result_of

ATTEMPTS: Final = 3
"""Runs of a sample that crashes or hangs, before it is reported as that."""
Kept = Literal["none", "failed", "all"]


class SweepStopped(ManipcliError):
    """A sample could not be run for a reason other than the sample: a full disk, another sweep in the same folder."""

    code = "RUN106"

    def __init__(self, sample: int, cause: str) -> None:
        super().__init__(f"sample {sample} was not run: {cause}")

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return (Diagnostic(self.code, str(self), hint="remove the cause, then go on with --resume"),)


class Backend(Protocol):
    """What runs samples."""

    def __call__(self, numbers: Iterable[int], *, beat: Callable[[], None]) -> Generator[SampleResult, None, None]:
        """Yields the result of each sample as it comes; whoever closes the generator ends what is running.

        Args:
            numbers: of the samples, in the order in which they start.
            beat: called often.

        Raises:
            SweepStopped: a sample cannot be run.
        """


def local_backend(
    job_of: Callable[[int], Job],
    *,
    at_once: int,
    keep: Kept = "none",
    command: tuple[str, ...] = (),
    pool: ForkPool | None = None,
) -> Backend:
    """Runs samples in `at_once` parallel processes; `command`, `pool`: see `run_jobs`."""

    def run(numbers: Iterable[int], *, beat: Callable[[], None]) -> Generator[SampleResult, None, None]:
        attempts = Counter[int]()
        jobs = deque(map(job_of, numbers))

        def observe(job: Job, heard: Beat) -> None:
            beat()

        with closing(run_jobs(jobs, at_once=at_once, observer=observe, command=command, pool=pool)) as reports:
            for report in reports:
                number = report.case.sample
                assert number is not None
                attempts[number] += 1
                if report.outcome in ("crashed", "hung") and attempts[number] < ATTEMPTS:
                    _remove(report)
                    jobs.appendleft(job_of(number))
                    continue
                if report.outcome == "error" and report.run is None:
                    raise SweepStopped(number, report.text)
                if keep == "none" or (keep == "failed" and report.passed):
                    _remove(report)
                yield result_of(report)

    return run


def _remove(report: CaseReport) -> None:
    for path in (report.log, report.output, report.picture):
        if path is not None:
            Path(path).unlink(missing_ok=True)
