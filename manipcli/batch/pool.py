"""Many jobs, a few at a time; each in its process, each watched."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from multiprocessing.connection import wait
from pathlib import Path

from manipcli.batch.job import Job
from manipcli.batch.process import Process
from manipcli.core.lock import Taken
from manipcli.report.suite import CaseReport, Trouble, doubts_of, troubles_of

WATCH_PERIOD = 0.1
"""[s] between two looks at what is being done, where nothing comes to an end."""
LONGEST_WAIT = 60.0
"""[s] between two looks where nobody is shown what is being done."""

Onlooker = Callable[[Sequence[Process]], None]


def run_jobs(
    jobs: Sequence[Job], *, at_once: int, onlooker: Onlooker | None = None, command: tuple[str, ...] = ()
) -> Generator[CaseReport, None, None]:
    """What came of each job, in the order in which they end.

    Whoever stops listening (`close`, an exception) ends what is running, and what that left is removed.

    Args:
        jobs: started in this order.
        at_once: how many run at a time.
        onlooker: shown what is running, some times a second.
        command: another program instead of `batch/child.py`.
    """
    waiting = deque(jobs)
    running: list[Process] = []
    try:
        while waiting or running:
            while waiting and len(running) < at_once:
                job = waiting.popleft()
                if job.case.findings:
                    yield _unreadable(job)
                    continue
                try:
                    running.append(Process(job, command=command))
                except Taken:
                    where = f"writes into '{job.settings.folder}', too"
                    yield _no_process(job, f"another process is running this task, and {where}; nothing was run")
                except OSError as error:
                    yield _no_process(job, f"it cannot be run: {error}")
            if not running:
                continue
            if onlooker is not None:
                onlooker(running)
            patience = max(0.0, min(process.patience for process in running))
            period = WATCH_PERIOD if onlooker else LONGEST_WAIT
            wait([process.connection for process in running], min(period, patience))
            for process in [*running]:
                report = process.hear()
                if report is None and process.patience <= 0.0:
                    report = process.give_up()
                if report is not None:
                    running.remove(process)
                    yield report
    finally:
        for process in running:
            process.forget()


def remove_empty(folder: Path) -> None:
    """Removes folders that hold nothing: `folder`, and those below it."""
    for place, _, _ in os.walk(folder, topdown=False):
        with suppress(OSError):
            Path(place).rmdir()


def _no_process(job: Job, why: str) -> CaseReport:
    return CaseReport(job.case, "error", 0.0, job.command(), why, troubles=(Trouble(why),))


def _unreadable(job: Job) -> CaseReport:
    from manipcli.batch.telling import write_invalid_page

    findings = job.case.findings
    notes: tuple[str, ...] = ()
    try:
        write_invalid_page(job, findings)
    except OSError as error:
        notes = (f"no page: {error}",)
    return CaseReport(
        case=job.case,
        outcome="invalid",
        duration=0.0,
        command=job.command(),
        text="the file cannot be read",
        findings=findings,
        troubles=troubles_of(findings),
        warnings=doubts_of(findings),
        page=None if job.page is None or notes else str(job.page),
        notes=notes,
    )
