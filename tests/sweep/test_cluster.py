"""Samples on the workers of a Dask cluster: the same results as on one machine, and faults of workers."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from threading import Event
from types import SimpleNamespace
from unittest.mock import patch

import pytest

from manipcli.batch.job import Settings
from manipcli.core.errors import InvalidInput
from manipcli.core.version import __version__
from manipcli.pipeline import run_task
from manipcli.sweep.journal import identity
from manipcli.sweep.local import Backend
from manipcli.sweep.results import SampleResult
from manipcli.sweep.sampling import Sampling
from tests.sweep.test_bundle import ROOT, TASK, surround

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A scheduler with one worker, in this process."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        yield cluster.scheduler_address


def test_a_cluster_gives_the_results_of_one_machine(tmp_path: Path, address: str) -> None:
    from manipcli.sweep.cluster import cluster_backend

    surround(tmp_path / "project", tmp_path / "shared")
    path = tmp_path / "project" / "tasks" / "held.yaml"
    path.write_text(TASK)
    settings = Settings(folder=tmp_path / "runs", pictures=False, keep_logs=True)
    sampling = Sampling(path, settings)
    backend = cluster_backend(sampling, path, settings, address, count=1, keep="all")
    (tmp_path / "shared").rename(tmp_path / "gone")  # workers have what was read before
    (found,) = backend([1], beat=lambda: None)
    (tmp_path / "gone").rename(tmp_path / "shared")
    alone = run_task(path, sample=1, log=tmp_path / "alone.mcap")
    assert (found.outcome, found.simulated) == (alone.verdict.verdict, alone.verdict.simulated_time)
    assert sampling.job(1).log.read_bytes() == (tmp_path / "alone.mcap").read_bytes()
    with (
        patch("manipcli.sweep.cluster.__version__", "0.0.1"),
        pytest.raises(InvalidInput, match=r"has manipcli [\d.]+, this is manipcli 0\.0\.1"),
    ):
        [*backend([1], beat=lambda: None)]


@pytest.fixture
def backend(tmp_path: Path, address: str) -> Iterator[Backend]:
    """Samples on the cluster, each of which only sleeps; it knows the seed of its task."""
    from manipcli.sweep.cluster import cluster_backend
    from manipcli.sweep.worker import Answer, SweepPlugin

    def answer(plugin: SweepPlugin, number: int) -> Answer:
        time.sleep(0.02)
        return Answer(SampleResult(number, "passed", cause=str(plugin._settings.seed)))

    path = held(tmp_path)
    settings = Settings(seed=7)
    with patch.object(SweepPlugin, "_answer", answer):
        yield cluster_backend(Sampling(path, settings), path, settings, address, count=30)


def held(folder: Path) -> Path:
    """A task with links to the files that it needs."""
    for name in ("robots", "controllers"):
        (folder / name).symlink_to(ROOT / name)
    path = folder / "held.yaml"
    path.write_text(TASK.replace("../", ""))
    return path


def test_samples_of_a_lost_connection_are_run_again(backend: Backend) -> None:
    clients: list[distributed.Client] = []

    class Known(distributed.Client):  # type: ignore[misc]
        def __init__(self, *args: object, **options: object) -> None:
            super().__init__(*args, **options)
            clients.append(self)

    numbers: list[int] = []
    with patch("manipcli.sweep.cluster.Client", Known):
        for result in backend(range(30), beat=lambda: None):
            numbers.append(result.number)
            if len(numbers) in (4, 12):
                clients[-1].loop.add_callback(clients[-1].scheduler_comm.comm.abort)
    assert sorted(numbers) == [*range(30)]
    assert len(clients) == 3


def test_a_scheduler_that_forgot_the_task_gets_it_again(backend: Backend) -> None:
    """As one that was started anew behind the same address: the connection is lost, and it has no plugin."""
    clients: list[distributed.Client] = []

    def remember(*args: object, **options: object) -> distributed.Client:
        clients.append(distributed.Client(*args, **options))
        return clients[-1]

    numbers: list[int] = []
    with patch("manipcli.sweep.cluster.Client", remember):
        for result in backend(range(12), beat=lambda: None):
            numbers.append(result.number)
            if len(numbers) == 4:
                names = clients[0].run_on_scheduler(lambda dask_scheduler: [*dask_scheduler.worker_plugins])
                (name,) = (name for name in names if name.startswith("manipcli"))
                clients[0].loop.add_callback(clients[0].scheduler_comm.comm.abort)
                with distributed.Client(clients[0].scheduler.address, set_as_default=False) as other:
                    other.unregister_worker_plugin(name)
    assert sorted(numbers) == [*range(12)]


def test_two_sweeps_of_the_same_files_at_once_keep_their_own_settings(
    backend: Backend, tmp_path: Path, address: str
) -> None:
    from manipcli.sweep.cluster import cluster_backend

    other = Settings(seed=8)
    path = tmp_path / "held.yaml"
    second = cluster_backend(Sampling(path, other), path, other, address, count=30)
    first = backend(range(8), beat=lambda: None)
    pairs = zip(first, second(range(8), beat=lambda: None), strict=True)
    assert {(a.cause, b.cause) for a, b in pairs} == {("7", "8")}


def test_a_worker_of_another_version_that_comes_later_is_refused_with_both(tmp_path: Path) -> None:
    from manipcli.sweep.cluster import cluster_backend

    with distributed.LocalCluster(
        n_workers=0, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        path = held(tmp_path)
        backend = cluster_backend(Sampling(path, Settings()), path, Settings(), cluster.scheduler_address, count=1)
        began = Event()

        def beat() -> None:
            if not began.is_set():
                began.set()
                cluster.scale(1)

        other = patch("manipcli.sweep.worker.__version__", "0.0.1")
        with other, pytest.raises(InvalidInput, match=rf"manipcli was {re.escape(__version__)}, is 0\.0\.1"):
            [*backend([0], beat=beat)]


def test_the_end_of_a_sweep_kills_what_runs_and_removes_its_files(tmp_path: Path) -> None:
    from manipcli.sweep.bundle import bundled
    from manipcli.sweep.worker import SweepPlugin

    surround(tmp_path / "project", tmp_path / "shared")
    path = tmp_path / "project" / "tasks" / "held.yaml"
    path.write_text(TASK)
    sampling = Sampling(path, Settings())
    plugin = SweepPlugin(bundled(sampling, path), Settings(), identity(sampling.written), keep="none", count=1)
    worker = SimpleNamespace(local_directory=str(tmp_path / "worker"))
    Path(worker.local_directory).mkdir()
    killed = []

    def backend(numbers: list[int], *, beat: Callable[[], None]) -> Generator[SampleResult, None, None]:
        try:
            plugin.teardown(worker)  # while the sample runs
            while True:
                beat()
        finally:
            killed.extend(numbers)
        yield

    plugin.setup(worker)
    with patch("manipcli.sweep.worker.local_backend", lambda *_, **__: backend):
        answer = plugin.run(5)
    assert (answer.refused, answer.stopped) == ("", "the sweep has ended")
    assert killed == [5]
    assert [*Path(worker.local_directory).iterdir()] == []


def test_a_scheduler_that_is_not_there_is_told(tmp_path: Path) -> None:
    from manipcli.sweep.cluster import cluster_backend

    path = held(tmp_path)
    sampling = Sampling(path, Settings())
    backend = cluster_backend(sampling, path, Settings(), "tcp://127.0.0.1:9", count=1)
    short = patch.multiple("manipcli.sweep.cluster", CONNECTING=1.0, ASKING=1.0)
    with short, pytest.raises(InvalidInput, match="there is no scheduler"):
        [*backend([0], beat=lambda: None)]
