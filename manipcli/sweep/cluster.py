"""Samples run by the workers of a Dask cluster that is already there."""

from __future__ import annotations

import math
import time
import uuid
from asyncio import CancelledError as AsyncCancelled
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import CancelledError
from contextlib import suppress
from pathlib import Path
from threading import Event
from typing import Final

from distributed import Client, Future, KilledWorker

from manipcli.batch.job import Settings
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import escape
from manipcli.core.version import __version__
from manipcli.core.whole_file import write_whole
from manipcli.sweep.bundle import bundled
from manipcli.sweep.journal import identity
from manipcli.sweep.local import ATTEMPTS, Backend, Kept, SweepStopped
from manipcli.sweep.results import SampleResult
from manipcli.sweep.sampling import Sampling
from manipcli.sweep.worker import Answer, SweepPlugin, run_on_worker

AHEAD: Final = 3
"""Samples that are given to the cluster per thread of its workers: enough that none waits."""
COUNTING: Final = 1.0
"""[s] between two looks at the workers."""
PERIOD: Final = 0.25
"""[s] between two looks at the samples."""
ASKING: Final = 5.0
"""[s] limit for an answer of the scheduler."""
CONNECTING: Final = 60.0
"""[s] limit of the time without a scheduler."""
_VERSION: Final = "__import__('manipcli.core.version', fromlist=['__version__']).__version__"


def cluster_backend(
    sampling: Sampling, path: Path, settings: Settings, address: str, *, count: int, keep: Kept = "none"
) -> Backend:
    """Runs samples on the cluster of a scheduler.

    Args:
        sampling: of the task.
        path: the task file.
        settings: of the runs.
        address: `tcp://HOST:PORT`.
        count: number of samples.
        keep: logs that are sent back, to where a local sweep writes them.
    """
    whose = identity(sampling.written)
    bundle = bundled(sampling, path)

    def run(numbers: Iterable[int], *, beat: Callable[[], None]) -> Generator[SampleResult, None, None]:
        plugin = SweepPlugin(bundle, settings, whose, keep=keep, count=count)
        cluster = _Cluster(address, plugin, beat)
        try:
            for answer in cluster.answers(numbers):
                if answer.result is not None and answer.log:
                    log = sampling.job(answer.result.number).log
                    log.parent.mkdir(parents=True, exist_ok=True)
                    write_whole(log, answer.log)
                if answer.result is not None:
                    yield answer.result
        finally:
            cluster.close()

    return run


class _Cluster:
    """A connection to a scheduler, which is restored where it is lost."""

    def __init__(self, address: str, plugin: SweepPlugin, beat: Callable[[], None]) -> None:
        self._address, self._plugin, self._beat = address, plugin, beat
        self._pending: dict[Future, int] = {}
        self._changed = Event()
        self._threads, self._counted = 0, -math.inf
        self._client = self._connected()

    def close(self) -> None:
        """Ends what is running, and removes the task from the workers."""
        with suppress(Exception):  # the scheduler may be gone
            self._client.cancel([*self._pending], force=True)
            self._client.unregister_worker_plugin(self._plugin.name)
        with suppress(OSError):
            self._client.close(timeout=ASKING)

    def answers(self, numbers: Iterable[int]) -> Generator[Answer, None, None]:
        """The answers of the workers, as they come; a sample that was lost is given to another worker.

        Raises:
            InvalidInput: there is no scheduler any more, or a worker has another version.
            SweepStopped: a sample cannot be run.
        """
        todo, killed = deque(numbers), Counter[int]()
        while todo or self._pending:
            with suppress(OSError):  # the connection is lost, which its futures show
                self._submit(todo)
            self._changed.wait(PERIOD)
            self._changed.clear()
            self._beat()
            done = {each: self._pending.pop(each) for each in [*self._pending] if each.done()}
            finished = {each: number for each, number in done.items() if each.status == "finished"}
            try:
                answers = dict(zip(finished, self._client.gather([*finished]), strict=True))
            except (OSError, AsyncCancelled, CancelledError, KilledWorker):
                answers = {}
            for future, number in done.items():
                if future in answers:
                    yield self._checked(number, answers[future])
                elif future.status == "error":
                    error = future.exception(timeout=ASKING)
                    if not isinstance(error, KilledWorker):
                        raise SweepStopped(number, f"{type(error).__name__}: {error}")
                    killed[number] += 1
                    if killed[number] < ATTEMPTS:
                        todo.appendleft(number)
                    else:
                        yield Answer(SampleResult(number, "crashed", "the worker was lost with this sample"))
                else:
                    todo.appendleft(number)
            if self._client.status != "running" or len(answers) < len(finished) or any(map(_is_lost, done)):
                todo.extendleft(self._pending.values())
                self._pending.clear()
                with suppress(OSError):
                    self._client.close(timeout=1.0)
                self._client = self._connected()

    def _submit(self, todo: deque[int]) -> None:
        """
        Raises:
            OSError: the connection is lost.
        """
        if time.monotonic() > self._counted + COUNTING:
            self._threads, self._counted = sum(self._client.nthreads().values()), time.monotonic()
        threads = self._threads if self._client.status == "running" else 0
        while todo and len(self._pending) < AHEAD * threads:
            key = f"manipcli-{todo[0]}-{uuid.uuid4().hex}"
            future = self._client.submit(run_on_worker, self._plugin.name, todo[0], key=key, pure=False)
            future.add_done_callback(lambda _: self._changed.set())
            self._pending[future] = todo.popleft()

    def _connected(self) -> Client:
        """
        Raises:
            InvalidInput: there is no scheduler, or a worker has another version.
        """
        deadline = time.monotonic() + CONNECTING
        while True:
            try:
                return self._connected_once()
            except OSError as error:  # also where the connection is lost meanwhile
                if time.monotonic() < deadline:
                    self._beat()
                    time.sleep(PERIOD)
                    continue
                message = f"there is no scheduler at '{escape(self._address)}': {escape(str(error))}"
                raise InvalidInput([Diagnostic("USE191", message, hint="start one with `dask scheduler`")]) from None

    def _connected_once(self) -> Client:
        """
        Raises:
            InvalidInput: a worker has another version.
            OSError: there is no scheduler, or the connection was lost.
        """
        try:
            client = Client(self._address, timeout=ASKING, set_as_default=False)
        except ValueError as error:
            message = f"'{escape(self._address)}' is not the address of a scheduler: {escape(str(error))}"
            raise InvalidInput([Diagnostic("USE191", message, hint="write tcp://HOST:PORT")]) from None
        for worker, version in client.run(eval, _VERSION, on_error="return").items():
            if version != __version__:
                client.close()
                has = f"manipcli {version}" if isinstance(version, str) else f"no manipcli ({version})"
                message = f"the worker at {worker} has {has}, this is manipcli {__version__}"
                raise InvalidInput([Diagnostic("USE192", message, hint="install the same version on all machines")])
        client.register_plugin(self._plugin)
        return client

    def _checked(self, number: int, answer: Answer) -> Answer:
        if answer.refused:
            message = f"a worker does not have the same task: {answer.refused}"
            raise InvalidInput([Diagnostic("USE192", message, hint="install the same versions on all machines")])
        if answer.stopped:
            raise SweepStopped(number, answer.stopped)
        return answer


def _is_lost(future: Future) -> bool:
    """Whether the connection was lost: nobody else cancels."""
    return future.status in ("cancelled", "lost")
