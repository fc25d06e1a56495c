"""Points of a map, planned by processes of this machine. A process that crashes or hangs costs its point only."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from os import environ
from tempfile import TemporaryFile
from typing import Final, TypeAlias

from manipcli.batch.forks import ONE_THREAD
from manipcli.report.suite.suite import signal_name
from manipcli.sweep.reach.question import PointResult, Question

Asked: TypeAlias = "Question | tuple[int, tuple[str, ...]]"
"""What a worker is sent: the question first, then number and overrides of each point."""
WORKER: Final = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from manipcli.sweep.reach.worker import main
main(int(sys.argv[2]))
"""
"""The worker has the module path of its parent, and not the working directory (`-P`)."""
ATTEMPTS: Final = 2
"""Times that a point is planned whose process crashes, before it is reported as that."""
LONGEST: Final = 600.0
"""[s] for one point, after which its process is stopped; the search itself has a budget of work."""
BEAT: Final = 0.2
"""[s] at most between two calls of `beat`."""


def planned_points(
    question: Question,
    points: Iterable[tuple[int, tuple[str, ...]]],
    *,
    at_once: int,
    beat: Callable[[], None] = lambda: None,
) -> Generator[PointResult, None, None]:
    """Plans points in `at_once` parallel processes, and yields their results as they come.

    An exception (an interrupt) and `close` end the processes.

    Args:
        question: what the points have in common.
        points: number and overrides of each.
        at_once: number of processes.
        beat: called often.
    """
    waiting, attempts = deque(points), Counter[int]()
    idle: list[_Worker] = []
    busy: list[_Worker] = []
    try:
        while waiting or busy:
            while waiting and len(busy) < at_once:
                worker = idle.pop() if idle else _Worker(question)
                busy.append(worker)
                worker.ask(waiting.popleft())
            wait([worker.connection for worker in busy], BEAT)
            for worker in [*busy]:
                result = worker.heard()
                if result is None:
                    continue
                busy.remove(worker)
                if result.outcome not in ("crashed", "hung"):
                    idle.append(worker)
                else:
                    worker.end()
                    attempts[result.number] += 1
                    if result.outcome == "crashed" and attempts[result.number] < ATTEMPTS:
                        waiting.appendleft(worker.point)
                        continue
                yield result
            beat()
    finally:
        for worker in (*idle, *busy):
            worker.end()


class _Worker:
    """A process and the point that it plans."""

    def __init__(self, question: Question) -> None:
        ours, theirs = Pipe()
        self.connection: Connection[Asked, PointResult] = ours
        self._errors = TemporaryFile()  # noqa: SIM115 (closed by `end`)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", WORKER, json.dumps(sys.path), str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=self._errors,
                stderr=self._errors,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,  # signals of the terminal reach only the parent
                env={**ONE_THREAD, **environ},
            )
        self.point: tuple[int, tuple[str, ...]] = (0, ())
        self._began = 0.0
        with suppress(ConnectionError):  # it has exited already, which `heard` finds
            self.connection.send(question)

    def ask(self, point: tuple[int, tuple[str, ...]]) -> None:
        self.point, self._began = point, time.monotonic()
        with suppress(ConnectionError):
            self.connection.send(point)

    def heard(self) -> PointResult | None:
        """The result of its point, also where it has died or takes too long; None before."""
        try:
            if self.connection.poll():
                return self.connection.recv()
        except (EOFError, OSError):
            return self._lost()
        if time.monotonic() - self._began < LONGEST:
            return None
        text = f"planning took longer than {LONGEST:g} s"
        return PointResult(self.point[0], "hung", reason=text, cause=text)

    def end(self) -> None:
        """Ends the process."""
        self._process.kill()
        self._process.wait()
        self.connection.close()
        self._errors.close()

    def _lost(self) -> PointResult:
        code = self._process.wait()
        text = f"planning crashed by {signal_name(-code)}" if code < 0 else "planning ended by an internal error"
        self._errors.seek(0)
        last = self._errors.read().decode("utf-8", "replace").strip().rpartition("\n")[2]
        return PointResult(self.point[0], "crashed", reason=text, cause=f"{text}: {last}" if code >= 0 else text)
