"""The process of one run: receives a job from its parent, runs it, and sends heartbeats and the result."""

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
    from manipcli.run.prepared import Prepared
    from manipcli.task.plan_steps import PlannedStep

BEAT_PERIOD = 0.25
"""[s] of wall time between two heartbeats during the simulation."""

Parent: TypeAlias = "Connection[Message, Job]"


def main(descriptor: int, prepared: Prepared | None = None) -> None:
    """Runs one job, received on the socket with this descriptor.

    Args:
        descriptor: of the socket.
        prepared: its task, loaded and planned before this process was forked.
    """
    collector.spare()
    parent: Parent = Connection(descriptor)
    os.set_inheritable(descriptor, False)
    os.dup2(2, 1)  # libraries print to stderr: stdout has no result
    # A crash of native code, and SIGUSR1 of a parent that stops this process, print where it was.
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1)
    # Ctrl-C of a terminal is handled by the parent.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job = parent.recv()
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    parent.send(_end_of(job, _Beats(parent), prepared))


def _end_with(parent: Parent) -> None:
    """Ends this process when the parent ends, which sends no further message."""
    parent.poll(None)
    os._exit(ExitCode.INTERRUPTED)


class _Beats:
    """The progress of a run, sent as heartbeats."""

    def __init__(self, parent: Parent) -> None:
        self.warnings: tuple[Diagnostic, ...] = ()
        self._parent = parent
        self._activity = ""
        self._written = ""
        self._at = 0.0
        self._next = 0.0

    def activity(self, what: str) -> None:
        """An activity outside of simulated time."""
        self._parent.send(Beat(what))

    def warned(self, findings: Sequence[Diagnostic]) -> None:
        self.warnings += tuple(findings)
        self.activity("warnings reported")

    def judged(self) -> None:
        """The time limit of the run ends here."""
        self._parent.send(Beat("judged", judged=True))

    def message(self, text: str, *, detail: bool) -> None:
        """A step was re-planned, which may have taken long, or is retried."""
        self._parent.send(Beat(self._activity, self._at, written=self._written))

    def step_started(self, step: PlannedStep, index: int, total: int) -> None:
        self._activity = f"step {index + 1} of {total}, '{step.id}'"
        self._written = step.place
        self._parent.send(Beat(self._activity, written=self._written))
        self._next = 0.0

    def tick(self, simulated_time: float, wall: float) -> None:
        self._at = simulated_time
        if wall >= self._next:
            self._next = wall + BEAT_PERIOD
            activity = self._activity or "before the first step"
            self._parent.send(Beat(activity, simulated_time, written=self._written))

    def step_ended(self, outcome: StepOutcome) -> None:
        """The next step begins, or the run is judged."""
        self._activity = f"after {self._activity}"
        self._parent.send(Beat(self._activity, self._at, written=self._written))


def _end_of(job: Job, beats: _Beats, prepared: Prepared | None = None) -> End:
    """Runs a job; writes its log and, where requested, its picture and page."""
    from manipcli import pipeline
    from manipcli.batch.baseline import kept_baseline
    from manipcli.batch.failure_report import against_baseline, draw, troubles, write_invalid_page, write_page
    from manipcli.batch.variants import measured, with_step
    from manipcli.record.faults import RecordingFailed

    beats.activity("loading")
    settings = job.settings
    job.log.parent.mkdir(parents=True, exist_ok=True)
    try:
        job = with_step(job)
        settings = job.settings
        report = pipeline.run_task(
            job.path,
            sample=job.case.sample,
            log=job.log,
            force=True,
            progress=beats,
            prepared=prepared,
            **job.loading.options,
        )
    except InvalidInput as invalid:
        unusable = invalid.findings
        return End(None, unusable, notes=_noted("no page", lambda: write_invalid_page(job, unusable)))
    except RecordingFailed as failure:  # sent to the parent: the disk may be full
        return End(None, troubles=(Trouble(str(failure), at=failure.time),), warnings=beats.warnings)
    beats.judged()
    found = troubles(job, report.verdict)
    findings: tuple[Diagnostic, ...] = ()
    notes: list[str] = []
    compare = report.verdict.verdict == "passed" and job.nominal and settings.baseline
    if compare and kept_baseline(job.path).exists():
        beats.activity("comparing with the baseline")
        try:
            found, better = against_baseline(job, report.verdict)
            notes += better
        except InvalidInput as invalid:
            findings, found = invalid.findings, troubles_of(invalid.findings)
    if found and report.log is not None and settings.pictures:
        beats.activity("drawing a picture")
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
        beats.activity("writing a page")
        notes += _noted("no page", lambda: write_page(job, report, found))
    numbers = []
    notes += _noted("not compared", lambda: numbers.append(measured(job, report)))
    return End(report, findings, found, beats.warnings, tuple(notes), next(iter(numbers), None))


def _noted(what: str, make: Callable[[], None]) -> tuple[str, ...]:
    """Makes something that does not affect the verdict; returns a note if that fails."""
    try:
        make()
    except (ManipcliError, OSError) as error:
        return (f"{what}: {error}",)
    return ()
