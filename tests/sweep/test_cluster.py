"""Samples on the workers of a Dask cluster: the same results as on one machine, and faults of workers."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import pytest

from manipcli.batch.job import Settings
from manipcli.core.errors import InvalidInput
from manipcli.pipeline import run_task
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


def test_a_scheduler_that_is_not_there_is_told(tmp_path: Path) -> None:
    from manipcli.sweep.cluster import cluster_backend

    path = tmp_path / "held.yaml"
    for name in ("robots", "controllers"):
        (tmp_path / name).symlink_to(ROOT / name)
    path.write_text(TASK.replace("../", ""))
    sampling = Sampling(path, Settings())
    backend = cluster_backend(sampling, path, Settings(), "tcp://127.0.0.1:9", count=1)
    with patch("manipcli.sweep.cluster.CONNECTING", 1.0), pytest.raises(InvalidInput, match="there is no scheduler"):
        [*backend([0], beat=lambda: None)]
