"""What a sweep costs beyond its runs, and what a second worker gains: `python -m benchmarks.sweep`.

- Throughput: wall time of a sweep with two workers against one.
- Cost of a sample: processor time of one more sample (of a long sweep less a short one), less its own phases plan,
  simulate and judge (wall time of one at a time), against the phase simulate of PyBullet.
- Overhead of a backend: wall time per sample of 1000 samples of which nothing is run, by the processes of this machine
  and by a Dask cluster of one worker, both with one sample at a time.

    python -m benchmarks.sweep
    python -m benchmarks.sweep --quick
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from unittest.mock import patch

from benchmarks.processes import ENVIRONMENT, MANIPCLI, POUR, ROOT
from benchmarks.sweep_faults import TASK
from benchmarks.table import Row, markdown
from manipcli.batch.job import Settings
from manipcli.batch.process import run_jobs
from manipcli.sweep.results import SampleResult
from manipcli.sweep.sampling import Sampling

PHASES: Final = ("plan", "simulate", "judge")
TRIVIAL: Final = 1000
CHILD: Final = """
from multiprocessing.connection import Connection
from manipcli.batch.job import End
def run(descriptor, prepared=None):
    parent = Connection(descriptor)
    parent.recv()
    parent.send(End(None))
"""
"""A run that does nothing, in a forked process."""


@dataclass(frozen=True)
class Cost:
    """[s] of a command with all its processes."""

    wall: float
    processor: float


def sweep(samples: int, workers: int, folder: Path) -> Cost:
    """The cost of a sweep of the pour."""
    words = ["sweep", str(POUR), "--samples", str(samples), "-n", str(workers), "--folder", str(folder), "--force"]
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-c", MANIPCLI, *words, "-q", "--at-least", "0%"]
    subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Cost(time.perf_counter() - began, processor)


def phases(samples: Sequence[int], folder: Path) -> dict[str, float]:
    """Mean [s] of each phase of samples, run one at a time by the processes of a sweep."""
    total = dict.fromkeys(PHASES, 0.0)
    sampling = Sampling(POUR, Settings(folder=folder / "phases", pictures=False))
    for report in run_jobs(map(sampling.job, samples)):
        assert report.run is not None
        for phase in PHASES:
            total[phase] += getattr(report.run.timing, phase) / len(samples)
    return total


def sample_rows(rounds: int, few: int, many: int) -> list[Row]:
    """Throughput of two workers, and the cost of a sample."""
    gains, costs, shares = [], [], []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        folder = Path(name)
        for number in range(rounds):
            print(f"round {number + 1} of {rounds}", file=sys.stderr, flush=True)
            short, one, two = sweep(few, 1, folder), sweep(many, 1, folder), sweep(many, 2, folder)
            own = phases(range(few, many), folder)
            gains.append(two.wall / one.wall)
            cost = (one.processor - short.processor) / (many - few) - sum(own.values())
            costs.append(1e3 * cost)
            shares.append(cost / own["simulate"])
    return [
        Row("sweep: two workers / one", tuple(gains), "x", 1 / 1.9, f"{many} pours, wall time; two quiet cores"),
        Row("a sample beyond its phases / simulate", tuple(shares), "x", 0.05, f"pours {few} to {many}, PyBullet"),
        Row("the same", tuple(costs), "ms", None, "processor time"),
    ]


def overhead_rows(rounds: int) -> list[Row]:
    """Overhead of both backends with samples that do nothing."""
    local, dask, cluster = [], [], []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        folder = Path(name)
        for link in ("robots", "controllers"):
            (folder / link).symlink_to(ROOT / link)
        (folder / "tasks").mkdir()
        path = folder / "tasks" / "held.yaml"
        path.write_text(TASK)
        settings = Settings(folder=folder / "runs", pictures=False)
        sampling = Sampling(path, settings)
        for _ in range(rounds):
            local.append(1e3 * _local(sampling) / TRIVIAL)
            start, spent = _dask(sampling, path, settings)
            dask.append(1e3 * spent / TRIVIAL)
            cluster.append(start)
    return [
        Row("overhead per sample, fork workers", tuple(local), "ms", 10.0, f"{TRIVIAL} samples that do nothing"),
        Row("overhead per sample, Dask", tuple(dask), "ms", 10.0, "the same without their processes"),
        Row("start of a Dask LocalCluster", tuple(cluster), "s", None, "one worker process, import of Dask included"),
    ]


def _local(sampling: Sampling) -> float:
    """[s] of samples whose forked processes do nothing; the start of the server is not part of it."""
    from manipcli.batch.forks import ForkPool
    from manipcli.sweep.local import local_backend

    server = f"""
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from manipcli.batch.fork_server import main
import manipcli.batch.child
from manipcli.run import libraries
libraries.load_common()
{CHILD}
main(int(sys.argv[2]), run=run)
"""
    pool = ForkPool([sampling.job(0)] * TRIVIAL, command=(sys.executable, "-P", "-c", server, json.dumps(sys.path)))
    pool.open()
    backend = local_backend(sampling.job, at_once=1, pool=pool)
    numbers = iter(backend(range(TRIVIAL), beat=lambda: None))
    for _ in range(10):  # the template is prepared meanwhile
        next(numbers)
    began = time.perf_counter()
    count = sum(1 for _ in numbers)
    pool.close()
    return (time.perf_counter() - began) * TRIVIAL / count


def _dask(sampling: Sampling, path: Path, settings: Settings) -> tuple[float, float]:
    """[s] of the start of a cluster, and of samples that its worker answers at once."""
    began = time.perf_counter()
    from distributed import LocalCluster, WorkerPlugin

    from manipcli.sweep.cluster import cluster_backend
    from manipcli.sweep.worker import Answer

    class Trivial(WorkerPlugin):  # type: ignore[misc]  # sent by value
        def __init__(self, *_: object, **__: object) -> None:
            self.name = "manipcli-benchmark"

    def answer(name: str, number: int) -> Answer:
        return Answer(SampleResult(number, "passed"))

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        start = time.perf_counter() - began
        backend = cluster_backend(sampling, path, settings, cluster.scheduler_address, count=TRIVIAL)
        with (
            patch("manipcli.sweep.cluster.run_on_worker", answer),
            patch("manipcli.sweep.cluster.SweepPlugin", Trivial),
        ):
            numbers = iter(backend(range(TRIVIAL), beat=lambda: None))
            next(numbers)
            began = time.perf_counter()
            count = sum(1 for _ in numbers)
    return start, (time.perf_counter() - began) * TRIVIAL / count


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="one round of fewer samples")
    options = parser.parse_args()
    rounds, few, many = (1, 4, 8) if options.quick else (options.rounds, 10, 40)
    for rows in (overhead_rows(rounds), sample_rows(rounds, few, many)):
        print(markdown(rows), flush=True)  # the first table is there within a minute


if __name__ == "__main__":
    main()
