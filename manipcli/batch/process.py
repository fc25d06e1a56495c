"""One run in its own process, seen from its parent: start, watchdog, and report."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from dataclasses import replace
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from socket import SO_RCVTIMEO, SOL_SOCKET, socket
from struct import pack
from typing import TypeAlias

from manipcli.batch.forks import ONE_THREAD, Forked, ForkPool
from manipcli.batch.job import Beat, End, Job, Message
from manipcli.batch.run_files import locked, remove
from manipcli.core.errors import ExitCode
from manipcli.core.lock import Taken
from manipcli.core.whole_file import write_whole
from manipcli.report.run_report import exit_code
from manipcli.report.suite.suite import CaseReport, CaseWord, Trouble, signal_name, troubles_of, warnings_of

Child: TypeAlias = "Connection[Job, Message]"

CHILD = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from manipcli.batch.child import main
main(int(sys.argv[2]))
"""
"""The child has the module path of its parent, and not the working directory (`-P`)."""
DRAWING = """
import json, sys
sys.path[:], log, picture, packages, outside = json.loads(sys.argv[1])
from pathlib import Path
from manipcli.batch.failure_report import draw
draw(Path(log), Path(picture), package_path=[Path(path) for path in packages], allow_outside=outside)
"""
"""Draws the partial log of a run that did not end."""
DRAWING_TIME = 30.0
"""[s] limit of the time for drawing."""
LAST_WORDS = 0.5
"""[s] for a process to write its stack trace before it is killed."""
TELLING_TIME = 60.0
"""[s] least limit of silence after the verdict, while pictures and pages are made."""
HALF_SAID = 5.0
"""[s] limit for a process to complete a message, and to exit after its last one."""
LONGEST_WAIT = 60.0
"""[s] between two checks of a silent run."""
_WORDS: dict[ExitCode, CaseWord] = {ExitCode.PASSED: "passed", ExitCode.FAILED: "failed"}


def run_job(job: Job, *, command: tuple[str, ...] = (), pool: ForkPool | None = None) -> CaseReport:
    """Runs a job and returns its report; see `run_jobs`."""
    (report,) = run_jobs([job], command=command, pool=pool)
    return report


def run_jobs(
    jobs: Iterable[Job],
    *,
    at_once: int = 1,
    observer: Callable[[Job, Beat], None] | None = None,
    command: tuple[str, ...] = (),
    server: tuple[str, ...] = (),
    pool: ForkPool | None = None,
) -> Generator[CaseReport, None, None]:
    """Runs jobs and yields their reports, in the order in which they end.

    An exception (an interrupt) and `close` kill what is running and remove its files.

    Args:
        jobs: the runs, in the order in which they start; the caller may change a deque between two reports.
        at_once: number of parallel runs.
        observer: callback for each start and each heartbeat.
        command: another program instead of `batch/child.py`, started as a new process.
        server: another program instead of `batch/fork_server.py`.
        pool: an open one, of whoever starts runs one at a time; it stays open.
    """
    waiting = jobs if isinstance(jobs, deque) else deque(jobs)
    running: list[Process] = []
    own = None if pool is not None else ForkPool([] if command and not server else waiting, command=server)
    pool = pool or own
    try:
        if own is not None:
            own.open()
        while waiting or running:
            while waiting and len(running) < at_once:
                started = _started(waiting.popleft(), command, pool)
                if isinstance(started, CaseReport):
                    yield started
                    continue
                running.append(started)
                if observer is not None:
                    observer(started.job, started.activity)
            patience = min((process.patience for process in running), default=0.0)
            wait([process.connection for process in running], max(0.0, min(LONGEST_WAIT, patience)))
            for process in [*running]:
                report = process.hear()
                if report is None and process.patience <= 0.0:
                    report = process.give_up()
                if report is not None:
                    running.remove(process)
                    yield report
                elif observer is not None:
                    observer(process.job, process.activity)
    finally:
        for process in running:
            process.forget()
        if own is not None:
            own.close()


def _started(job: Job, command: tuple[str, ...], pool: ForkPool | None) -> Process | CaseReport:
    """The process of a job, or why there is none."""
    if job.case.findings:
        return _unreadable(job)
    try:
        return Process(job, command=command, pool=pool)
    except Taken:
        where = f"writes to '{job.settings.folder}'"
        return _no_process(job, f"another process is running this task and {where}; nothing was run")
    except OSError as error:
        return _no_process(job, f"the task cannot be run: {error}")


class Process:
    """A running job.

    Attributes:
        job: the job.
        connection: readable when the process has sent a message or has exited.
        activity: its last heartbeat.
    """

    def __init__(self, job: Job, *, command: tuple[str, ...], pool: ForkPool | None = None) -> None:
        """Starts the process.

        Args:
            job: the job.
            command: another program with the messages of `batch/child.py`.
            pool: forks the process where it can.

        Raises:
            Taken: a process of another batch is running this job.
            OSError: its files cannot be written, or no process can be started.
        """
        self.job = job
        job.output.parent.mkdir(parents=True, exist_ok=True)
        self._output = locked(job.output)
        self.activity = Beat("starting")
        self._end: End | None = None
        self._judged: float | None = None
        self._began = self._heard = time.monotonic()
        remove(job.log, job.partial, job.picture, job.page)
        self.connection: Child
        self._process: subprocess.Popen[bytes] | Forked
        try:
            forked = self._forked(pool) if pool is not None else None
            self._note = pool.take_note() if pool is not None else ""
            self.connection, self._process = forked or self._new(command)
        except BaseException:  # an interrupt, too
            remove(job.output)
            self._output.close()
            raise
        with socket(fileno=os.dup(self.connection.fileno())) as duplicate:
            duplicate.setsockopt(SOL_SOCKET, SO_RCVTIMEO, pack("ll", *divmod(round(1e6 * HALF_SAID), 1_000_000)))
        with suppress(ConnectionError):  # it has exited already, which `hear` finds
            self.connection.send(job)

    def _forked(self, pool: ForkPool) -> tuple[Child, Forked] | None:
        ours, childs = Pipe()
        with childs:
            process = pool.start(self.job, childs.fileno(), self._output.fileno())
        if process is None:
            ours.close()
            return None
        return ours, process

    def _new(self, command: tuple[str, ...]) -> tuple[Child, subprocess.Popen[bytes]]:
        ours, childs = Pipe()
        with childs:
            process = subprocess.Popen(
                [*(command or (sys.executable, "-P", "-c", CHILD, json.dumps(sys.path))), str(childs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=self._output,
                pass_fds=(childs.fileno(),),
                start_new_session=True,  # signals of the terminal reach only the parent
                env={**ONE_THREAD, **os.environ},
            )
        return ours, process

    @property
    def elapsed(self) -> float:
        """[s] from its start to its verdict, or to now."""
        return (time.monotonic() if self._judged is None else self._judged) - self._began

    @property
    def patience(self) -> float:
        """[s] until it will be stopped, unless it sends a message."""
        silent = time.monotonic() - self._heard
        if self._judged is not None:
            return self._silence - silent
        return min(self._silence - silent, self.job.settings.timeout - self.elapsed)

    @property
    def _silence(self) -> float:
        """[s] limit of the time without a message."""
        silence = self.job.settings.silence
        return silence if self._judged is None else max(silence, TELLING_TIME)

    def hear(self) -> CaseReport | None:
        """Receives the messages of the process; returns its report once it has exited."""
        try:
            while self.connection.poll():
                message = self.connection.recv()
                self._heard = time.monotonic()
                if isinstance(message, End):
                    self._end = message
                else:
                    self.activity = message
                    self._judged = self._heard if message.judged else self._judged
        except BlockingIOError:
            return self.give_up("it stopped in the middle of a message")
        except (EOFError, OSError):  # also in the middle of a message
            return self._gone()
        return None

    def give_up(self, why: str = "") -> CaseReport:
        """Kills the process: it exceeds its time or is silent for too long, or `why`."""
        timeout = self.job.settings.timeout
        over = self._judged is None and self.elapsed >= timeout
        limit = f"timeout after {timeout:g} s" if over else f"no progress for {self._silence:g} s"
        self._process.send_signal(signal.SIGUSR1)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(LAST_WORDS)
        self.end()
        return self._report("hung", f"hung: {why or limit}; {self.activity}")

    def end(self) -> None:
        """Kills the process, without a report."""
        self._process.kill()
        self._process.wait()
        self.connection.close()

    def forget(self) -> None:
        """Kills the process, and removes its files."""
        self.end()
        remove(self.job.log, self.job.partial, self.job.picture, self.job.output, self.job.page)
        self._output.close()

    def _gone(self) -> CaseReport:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(HALF_SAID)
        self.end()
        code, end = self._process.returncode, self._end
        if end is None:
            if code is None:
                return self._report("crashed", f"crashed, exit code unknown as the fork server ended; {self.activity}")
            if code < 0:
                cause = f"crashed by {signal_name(-code)}"
                hint = "; check that there is enough memory" if -code == signal.SIGKILL else ""
                return self._report("crashed", f"{cause}; {self.activity}{hint}")
            return self._report("crashed", f"ended with exit code {code} before it was done: {self._last_line()}")
        if end.report is None and end.troubles:
            return self._report("error", end.troubles[0].message, end=end)
        if end.report is None:
            return self._report("invalid", "the task cannot be run", end=end)
        word = _WORDS.get(exit_code(end.report.verdict), "error")
        if word == "passed" and end.troubles:  # worse than the baseline
            return self._report("failed", end.troubles[0].message, end=end, verb="test")
        return self._report(word, end.report.verdict.text, end=end)

    def _report(self, outcome: CaseWord, text: str, *, end: End | None = None, verb: str = "run") -> CaseReport:
        job, took = self.job, self.elapsed
        if end is None:
            end = End(None, troubles=(Trouble(text, self.activity.place(job.case.file), self.activity.at),))
        unfinished = outcome in ("crashed", "hung") or (outcome == "error" and end.report is None)
        if outcome == "passed" and not job.settings.keep_logs:
            job.log.unlink(missing_ok=True)
            end = replace(end, report=replace(end.report, log=None) if end.report is not None else None)
        if not unfinished:
            job.output.unlink(missing_ok=True)
        else:
            self._draw_what_is_left()
            if job.output.exists() and not job.output.stat().st_size:
                job.output.unlink()
        self._output.close()
        kept = {path: str(path) if path.exists() else None for path in (job.log, job.partial, job.picture, job.output)}
        report = CaseReport(
            case=job.case,
            outcome=outcome,
            duration=took,
            command=job.command(verb),
            text=text,
            run=end.report,
            findings=end.findings,
            troubles=end.troubles or troubles_of(end.findings),
            warnings=end.warnings or warnings_of(end.findings),
            log=kept[job.log] or kept[job.partial],
            picture=kept[job.picture],
            page=str(job.page) if job.page is not None and job.page.exists() else None,
            output=kept[job.output],
            notes=(*end.notes, *([self._note] if self._note else [])),
            measured=end.measured,
        )
        return self._with_page(report) if unfinished else report

    def _with_page(self, report: CaseReport) -> CaseReport:
        """Adds the page that the child process did not write, where pages are requested."""
        page, index = self.job.page, self.job.index
        if page is None:
            return report
        from manipcli.report.html.case_page import render_case_page

        try:
            page.parent.mkdir(parents=True, exist_ok=True)
            write_whole(page, render_case_page(report, page.parent, index=index).encode())
        except OSError as error:
            return replace(report, notes=(*report.notes, f"no page: {error}"))
        return replace(report, page=str(page))

    def _draw_what_is_left(self) -> None:
        """Draws the end of the partial log, in another process: it may crash for the same reason as the run."""
        if not self.job.partial.exists() or not self.job.settings.pictures:
            return
        settings = self.job.settings
        packages = [str(path) for path in settings.package_path]
        arguments = [sys.path, str(self.job.partial), str(self.job.picture), packages, settings.allow_outside]
        with suppress(subprocess.TimeoutExpired):
            subprocess.run(
                [sys.executable, "-P", "-c", DRAWING, json.dumps(arguments)],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                timeout=DRAWING_TIME, check=False, start_new_session=True,
            )  # fmt: skip

    def _last_line(self) -> str:
        lines = self.job.output.read_text("utf-8", "replace").splitlines()
        return next((line.strip() for line in reversed(lines) if line.strip()), "it printed nothing")


def _no_process(job: Job, why: str) -> CaseReport:
    return CaseReport(job.case, "error", 0.0, job.command(), why, troubles=(Trouble(why),))


def _unreadable(job: Job) -> CaseReport:
    from manipcli.batch.failure_report import write_invalid_page

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
        warnings=warnings_of(findings),
        page=None if job.page is None or notes else str(job.page),
        notes=notes,
    )
