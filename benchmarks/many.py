"""What many bodies cost: `python -m benchmarks.many [--rounds N]`, the pour of 20 balls against that of one.

Both are planned, and simulated in both engines, in turn: the CPU time of a tick of each simulate phase, recording and
settling included, and of the plan.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Final
from unittest.mock import patch

from benchmarks.inside import has_mujoco
from benchmarks.table import Row, markdown
from benchmarks.twin import clock
from manipcli.pipeline import run_task

POUR: Final = Path(__file__).resolve().parents[1] / "tasks" / "granular_pour.yaml"
BALLS: Final = {1: ("params.balls=1", "params.enough=1"), 20: ()}
TICK: Final = 1e-3


def measured(folder: Path, balls: int, engine: str) -> tuple[float, float]:
    """Seconds that a tick of the simulate phase takes, and the plan."""
    overrides = (*BALLS[balls], f"simulation.engine={engine}")
    with patch("time.perf_counter", clock):
        report = run_task(POUR, log=folder / "pour.mcap", force=True, overrides=overrides)
    return report.timing.simulate / (report.verdict.simulated_time / TICK), report.timing.plan


def many_rows(rounds: int) -> list[Row]:
    """Ratios of 20 balls to one."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        folder = Path(name)
        for engine in ("pybullet", *(("mujoco",) if has_mujoco() else ())):
            measured(folder, 1, engine)  # imports, caches: does not count
            pairs = [(measured(folder, 1, engine), measured(folder, 20, engine)) for _ in range(rounds)]
            ticks = tuple(many[0] / one[0] for one, many in pairs)
            plans = tuple(many[1] / one[1] for one, many in pairs)
            rows.append(Row(f"tick with 20 balls / with one, {engine}", ticks, "x", 3.0, "simulate phase"))
            rows.append(Row(f"plan with 20 balls / with one, {engine}", plans, "x", None, "whole task"))
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.many", description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="of every measurement; the median is printed (default 3)")
    print(markdown(many_rows(parser.parse_args().rounds)))
