"""What a sample costs: processor time of `manipcli test TASK --samples N` per sample, against one run of the task."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from benchmarks.inside import has_mujoco
from benchmarks.processes import ENVIRONMENT, MANIPCLI, POUR, ROOT
from benchmarks.table import Row
from benchmarks.twin import ITERATIONS, REFERENCE

SAMPLES: Final = 6
"""Per round."""
PROCESSES: Final = 2


def sample_rows(rounds: int) -> list[Row]:
    """Samples with PyBullet and MuJoCo, in units of `manipcli run --sample K` with PyBullet and 200 iterations."""
    aims = {"pybullet": 1 / 1.5} | ({"mujoco": 1 / 3.0} if has_mujoco() else {})
    ratios: dict[str, list[float]] = {engine: [] for engine in aims}
    for _ in range(rounds):
        run = _runs() / SAMPLES
        for engine, values in ratios.items():
            values.append(_samples(engine) / SAMPLES / run)
    note = f"CPU, against manipcli run with {ITERATIONS} iterations; {SAMPLES} samples, {PROCESSES} processes"
    names = {"pybullet": "PyBullet", "mujoco": "MuJoCo"}
    return [
        Row(f"a sample of manipcli test, {names[engine]}", tuple(values), "x", aims[engine], note)
        for engine, values in ratios.items()
    ]


def _runs() -> float:
    """Processor time [s] of the samples, each run by a command of its own."""
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as folder:
        log = str(Path(folder) / "pour.mcap")
        words = ["run", str(POUR), "--quiet", "--force", "--log", log, *_sets(REFERENCE)]
        return sum(_processor_time([*words, "--sample", str(k)]) for k in range(SAMPLES))


def _samples(engine: str) -> float:
    """Processor time [s] of the same samples, run by one command with two processes."""
    counts = ["--samples", str(SAMPLES), "-n", str(PROCESSES)]
    return _processor_time(["test", str(POUR), "-q", *counts, *_sets((f"simulation.engine={engine}",))])


def _sets(overrides: Sequence[str]) -> list[str]:
    return [word for override in overrides for word in ("--set", override)]


def _processor_time(words: Sequence[str]) -> float:
    """[s] of a command and all processes that it started and waited for."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", MANIPCLI, *words], cwd=ROOT, env=ENVIRONMENT, capture_output=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
