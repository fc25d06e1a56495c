"""What a worker of a Dask cluster does: it unpacks the task once, and runs each sample in a process of its own."""

from __future__ import annotations

import shutil
import socket
import tempfile
import uuid
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock, Timer, get_ident
from typing import Final

from distributed import Worker, WorkerPlugin, get_worker

from manipcli.batch.forks import ForkPool
from manipcli.batch.job import Settings
from manipcli.core.errors import InvalidInput
from manipcli.core.version import __version__
from manipcli.sweep.bundle import Bundle
from manipcli.sweep.journal import VERSION, Identity, changes, identity
from manipcli.sweep.local import Kept, SweepStopped, local_backend
from manipcli.sweep.results import SampleResult
from manipcli.sweep.sampling import Sampling

IDLE: Final = 300.0
"""[s] without a sample after which the prepared processes of a worker end: the client may have been killed."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What a worker sends: a result with the log, if it is kept; or why the worker cannot run this task.

    Attributes:
        result: None where nothing was run.
        log: contents of the log.
        refused: how the task differs on the worker.
        stopped: why the sample cannot be run now.
    """

    result: SampleResult | None
    log: bytes = b""
    refused: str = ""
    stopped: str = ""


class SweepPlugin(WorkerPlugin):  # type: ignore[misc]  # distributed has no types
    """The task on a worker. Dask sends it to every worker, also to those that come later."""

    def __init__(self, bundle: Bundle, settings: Settings, whose: Identity, *, keep: Kept, count: int) -> None:
        self.name = f"manipcli-sweep-{uuid.uuid4().hex}"
        self._bundle, self._settings, self._whose = bundle, settings, dict(whose)
        self._keep: Kept = keep
        self._count = count

    def setup(self, worker: Worker) -> None:
        """On the worker."""
        self._lock = Lock()
        # Dask removes what a killed worker leaves there.
        self._folder = Path(tempfile.mkdtemp(prefix="manipcli-sweep-", dir=worker.local_directory))
        self._sampling: Sampling | None = None
        self._refused = ""
        self._pools: dict[int, ForkPool] = {}
        self._running = 0
        self._ended = False
        self._idle = Timer(IDLE, self._rest)

    def teardown(self, worker: Worker) -> None:
        """On the worker, at its end or that of the sweep."""
        self._ended = True
        self._idle.cancel()
        with self._lock:
            if not self._running:
                self._clear()

    def run(self, number: int) -> Answer:
        """Runs a sample in a process of its own."""
        with self._lock:
            self._idle.cancel()
            self._running += 1
        try:
            return self._answer(number)
        except (OSError, SweepStopped) as error:
            return Answer(None, stopped=f"{error} (on {socket.gethostname()})")
        except _Ended:
            return Answer(None, stopped="the sweep has ended")
        finally:
            with self._lock:
                self._running -= 1
                if self._ended and not self._running:
                    self._clear()
                elif not self._running:
                    self._idle = Timer(IDLE, self._rest)
                    self._idle.daemon = True
                    self._idle.start()

    def _answer(self, number: int) -> Answer:
        """
        Raises:
            OSError, SweepStopped: the sample cannot be run.
            _Ended: the sweep has ended.
        """
        with self._lock:
            sampling = self._prepared()
            if sampling is None:
                return Answer(None, refused=self._refused)
            pool = self._pools.get(get_ident())
            if pool is None:
                pool = ForkPool([sampling.job(0)] * self._count)
                pool.open()
                self._pools[get_ident()] = pool
        log = sampling.job(number).log
        backend = local_backend(sampling.job, at_once=1, keep=self._keep, pool=pool)
        with closing(backend([number], beat=self._beat)) as results:
            result = next(results)
        data = b""
        with suppress(FileNotFoundError):
            data = log.read_bytes()
            log.unlink()
        return Answer(result, data)

    def _beat(self) -> None:
        """
        Raises:
            _Ended: the sweep has ended, so that the running sample is killed.
        """
        if self._ended:
            raise _Ended

    def _rest(self) -> None:
        """Ends the prepared processes; the next sample starts others."""
        with self._lock:
            if not self._running:
                self._close_pools()

    def _clear(self) -> None:
        self._close_pools()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _close_pools(self) -> None:
        for pool in self._pools.values():
            pool.close()
        self._pools.clear()

    def _prepared(self) -> Sampling | None:
        """The task, loaded from the bundle and compared with that of the client; None where it differs.

        Raises:
            OSError: its files cannot be written.
        """
        if self._sampling is None and not self._refused:
            self._refused = changes({VERSION: self._whose[VERSION]}, {VERSION: __version__})
        if self._sampling is None and not self._refused:
            path, packages = self._bundle.unpack(Path(tempfile.mkdtemp(dir=self._folder)))
            settings = replace(self._settings, package_path=packages, folder=self._folder / "runs")
            try:
                sampling = Sampling(path, settings)
            except InvalidInput as error:
                self._refused = f"the task cannot be loaded on {socket.gethostname()}: {error}"
                return None
            self._refused = changes(self._whose, identity(sampling.written))
            if not self._refused:
                self._sampling = sampling
        return self._sampling


class _Ended(Exception):
    """The sweep has ended while a sample was running."""


def run_on_worker(name: str, number: int) -> Answer:
    """The task of Dask: a sample, by the plugin of this name."""
    plugin = get_worker().plugins[name]
    assert isinstance(plugin, SweepPlugin)
    return plugin.run(number)
