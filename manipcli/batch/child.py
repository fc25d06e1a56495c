"""The process of one run: takes a job from its parent, runs it, and sends signs of life and the end back."""

from __future__ import annotations

import faulthandler
import os
import signal
import threading
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, TypeAlias

from manipcli.batch.job import Beat, End, Job, Message
from manipcli.core import collector
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput, ManipcliError
from manipcli.judge.verdict import StepOutcome
from manipcli.report.suite.suite import Trouble, troubles_of

if TYPE_CHECKING:
    from manipcli.task.plan_task import PlannedStep

BEAT_PERIOD = 0.25
"""[s] of wall time between two signs of life while ticks go by."""

Parent: TypeAlias = "Connection[Message, Job]"


def main(descriptor: int) -> None:
    """One job, on the socket with this number."""
    collector.spare()
    parent: Parent = Connection(descriptor)
    os.set_inheritable(descriptor, False)
    os.dup2(2, 1)  # what libraries print is no result
    # A crash of native code, and the signal of a parent that gives up on this process, leave where it was.
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1)
    # A terminal's Ctrl-C is for the parent to act upon.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = parent.recv()
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    parent.send(_end_of(job, _Beats(parent)))


def _end_with(parent: Parent) -> None:
    """Waits for the parent, which says nothing more, to be gone, and goes, too."""
    parent.poll(None)
    os._exit(ExitCode.INTERRUPTED)


class _Beats:
    """The progress of a run, as signs of life."""

    def __init__(self, parent: Parent) -> None:
        self.warnings: tuple[Diagnostic, ...] = ()
        self._parent = parent
        self._doing = ""
        self._written = ""
        self._at = 0.0
        self._next = 0.0

    def doing(self, what: str) -> None:
        """Something that has no time of its own."""
        self._parent.send(Beat(what))

    def warned(self, findings: Sequence[Diagnostic]) -> None:
        self.warnings += tuple(findings)
        self.doing("told of doubts")

    def judged(self) -> None:
        """From here on the time is not that of the run."""
        self._parent.send(Beat("judged", judged=True))

    def told(self, text: str, *, detail: bool) -> None:
        """A step was planned again, which may have taken long, or is tried again."""
        self._parent.send(Beat(self._doing, self._at, written=self._written))

    def step_started(self, step: PlannedStep, index: int, total: int) -> None:
        self._doing = f"step {index + 1} of {total}, '{step.id}'"
        self._written = step.place
        self._parent.send(Beat(self._doing, written=self._written))
        self._next = 0.0

    def tick(self, simulated_time: float, wall: float) -> None:
        self._at = simulated_time
        if wall >= self._next:
            self._next = wall + BEAT_PERIOD
            doing = self._doing or "before the first step"
            self._parent.send(Beat(doing, simulated_time, written=self._written))

    def step_ended(self, outcome: StepOutcome) -> None:
        """The next one begins, or the run is judged."""
        self._doing = f"after {self._doing}"
        self._parent.send(Beat(self._doing, self._at, written=self._written))


def _end_of(job: Job, beats: _Beats) -> End:
    """Runs a job; its log, picture and page are written where they are wanted."""
    from manipcli import pipeline
    from manipcli.batch.baseline import kept_baseline
    from manipcli.batch.telling import against_baseline, draw, troubles, write_invalid_page, write_page
    from manipcli.record.faults import RecordingFailed

    beats.doing("loading")
    settings = job.settings
    job.log.parent.mkdir(parents=True, exist_ok=True)
    try:
        report = pipeline.run_task(
            job.path,
            overrides=settings.overrides,
            seed=settings.seed,
            sample=job.case.sample,
            log=job.log,
            force=True,
            package_path=settings.package_path,
            allow_outside=settings.allow_outside,
            progress=beats,
        )
    except InvalidInput as invalid:
        unusable = invalid.findings
        return End(None, unusable, notes=_noted("no page", lambda: write_invalid_page(job, unusable)))
    except RecordingFailed as failure:  # said to the parent: its words have no room on that disk either
        return End(None, troubles=(Trouble(str(failure), at=failure.time),), warnings=beats.warnings)
    beats.judged()
    found = troubles(job, report.verdict)
    findings: tuple[Diagnostic, ...] = ()
    notes: list[str] = []
    compare = report.verdict.verdict == "passed" and job.nominal and settings.baseline
    if compare and kept_baseline(job.path).exists():
        beats.doing("comparing with the baseline")
        try:
            found, better = against_baseline(job, report.verdict)
            notes += better
        except InvalidInput as invalid:
            findings, found = invalid.findings, troubles_of(invalid.findings)
    if found and report.log is not None:
        beats.doing("drawing a picture")
        notes += _noted(
            "no picture",
            lambda: draw(
                job.log,
                job.picture,
                at=found[0].at,
                meshes=report.meshes,
                package_path=settings.package_path,
                allow_outside=settings.allow_outside,
            ),
        )
    if job.page is not None:
        beats.doing("writing a page")
        notes += _noted("no page", lambda: write_page(job, report, found))
    return End(report, findings, found, beats.warnings, tuple(notes))


def _noted(what: str, make: Callable[[], None]) -> tuple[str, ...]:
    """Makes something without which the verdict stands; a note where that is refused."""
    try:
        make()
    except (ManipcliError, OSError) as error:
        return (f"{what}: {error}",)
    return ()
