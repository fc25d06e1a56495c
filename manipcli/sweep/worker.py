"""What a worker of a Dask cluster does: it unpacks the task once, and runs each sample in a process of its own."""

from __future__ import annotations

import shutil
import socket
import tempfile
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock, get_ident

from distributed import WorkerPlugin, get_worker

from manipcli.batch.forks import ForkPool
from manipcli.batch.job import Settings
from manipcli.core.errors import InvalidInput
from manipcli.sweep.bundle import Bundle
from manipcli.sweep.journal import Identity, changes, identity
from manipcli.sweep.local import Kept, SweepStopped, local_backend
from manipcli.sweep.results import SampleResult
from manipcli.sweep.sampling import Sampling


@dataclass(frozen=True, slots=True)
class Answer:
    """What a worker sends: a result with the log, if it is kept; or why the worker cannot run this task."""

    result: SampleResult | None
    log: bytes = b""
    refused: str = ""
    stopped: str = ""


class SweepPlugin(WorkerPlugin):  # type: ignore[misc]  # distributed has no types
    """The task on a worker. Dask sends it to every worker, also to those that come later."""

    def __init__(self, bundle: Bundle, settings: Settings, whose: Identity, *, keep: Kept, count: int) -> None:
        self.name = f"manipcli-sweep-{bundle.name}"
        self._bundle, self._settings, self._whose = bundle, settings, dict(whose)
        self._keep: Kept = keep
        self._count = count

    def setup(self, worker: object) -> None:
        """On the worker."""
        self._lock = Lock()
        self._folder = Path(tempfile.mkdtemp(prefix="manipcli-sweep-"))
        self._sampling: Sampling | None = None
        self._refused = ""
        self._pools: dict[int, ForkPool] = {}

    def teardown(self, worker: object) -> None:
        """On the worker, at its end."""
        for pool in self._pools.values():
            pool.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def run(self, number: int) -> Answer:
        """Runs a sample in a process of its own."""
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
        try:
            (result,) = backend([number], beat=lambda: None)
        except SweepStopped as stopped:
            return Answer(None, stopped=f"{stopped} (on {socket.gethostname()})")
        data = b""
        with suppress(FileNotFoundError):
            data = log.read_bytes()
            log.unlink()
        return Answer(result, data)

    def _prepared(self) -> Sampling | None:
        """The task, loaded from the bundle and compared with that of the client."""
        if self._sampling is None and not self._refused:
            try:
                path, packages = self._bundle.unpack(self._folder / "files")
                settings = replace(self._settings, package_path=packages, folder=self._folder / "runs")
                sampling = Sampling(path, settings)
            except (InvalidInput, OSError) as error:
                self._refused = f"the task cannot be loaded on {socket.gethostname()}: {error}"
                return None
            self._refused = changes(self._whose, identity(sampling.written))
            if not self._refused:
                self._sampling = sampling
        return self._sampling


def run_on_worker(name: str, number: int) -> Answer:
    """The task of Dask: a sample, by the plugin of this name."""
    plugin = get_worker().plugins[name]
    assert isinstance(plugin, SweepPlugin)
    return plugin.run(number)
