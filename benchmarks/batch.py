"""What is measured of tests: what two processes do in the time of one, and what the plugin costs who has no task."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.processes import ENVIRONMENT, MANIPCLI, POUR, ROOT, run
from benchmarks.table import Row

RUNS = 6
"""Of the pour, in a round."""
PLUGIN = ("-p", "manipcli.cli.pytest_plugin")
FOREIGN = 200
"""YAML files that are no tasks, in the folder in which the plugin is measured."""


def throughput_row(rounds: int) -> Row:
    """`manipcli test` with one process and with two, over the same runs."""
    ratios = []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as folder:
        for k in range(RUNS):
            text = POUR.read_text(encoding="utf-8").replace("../", f"{ROOT}/").replace("task: pour", f"task: pour_{k}")
            (Path(folder) / f"pour_{k}.yaml").write_text(text, encoding="utf-8")
        for _ in range(rounds):
            one, two = (run(MANIPCLI, ["test", folder, "-q", "-n", str(n)]).wall for n in (1, 2))
            ratios.append(two / one)
    return Row("manipcli test: two processes / one", tuple(ratios), "x", 1 / 1.8, f"{RUNS} pours; two quiet cores")


def plugin_row(rounds: int) -> Row:
    """pytest over a folder with one test and many foreign YAML files, with and without the plugin; the best of each
    three, as pytest itself varies by more than what is measured."""
    costs = []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as folder:
        for k in range(FOREIGN):
            (Path(folder) / f"config_{k}.yaml").write_text("on: push\njobs: {}\n" * 50, encoding="utf-8")
        (Path(folder) / "test_one.py").write_text("def test_one(): pass\n", encoding="utf-8")
        for _ in range(rounds + 1):
            bare = min(_pytest(folder) for _ in range(3))
            costs.append(1e3 * (min(_pytest(folder, *PLUGIN) for _ in range(3)) - bare))
    return Row("pytest plugin, where there is no task", tuple(costs[1:]), "ms", 30.0, f"{FOREIGN} foreign YAML files")


def _pytest(folder: str, *words: str) -> float:
    """Processor time [s], which other work on the machine changes less; without other people's plugins."""
    environment = ENVIRONMENT | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": str(ROOT)}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *words], cwd=folder, env=environment, capture_output=True, check=True
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
