"""What many bodies cost: `python -m benchmarks.many [--rounds N]`, 20 balls in the cup of the pour against one.

Both worlds are settled and held still, in both engines, in turn: the CPU time of a tick with all balls in contact,
without recording. And both tasks are planned.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from benchmarks.inside import has_mujoco
from benchmarks.table import Row, markdown
from benchmarks.twin import clock
from manipcli.run.execute import build_manager, open_session
from manipcli.simulate.executor import Executor
from manipcli.simulate.session import Session
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

POUR: Final = Path(__file__).resolve().parents[1] / "tasks" / "granular_pour.yaml"
BALLS: Final = {1: ("params.balls=1", "params.enough=1"), 20: ()}
HELD: Final = 1.0
"""[s] Simulated time of which the ticks are timed."""


def measured(balls: int, engine: str) -> tuple[float, float]:
    """Seconds that HELD takes, and the plan."""
    task = load_task(POUR, overrides=(*BALLS[balls], f"simulation.engine={engine}"))
    began = clock()
    plan = plan_task(task)
    planned = clock() - began
    with open_session(task, plan, build_manager(task), Session) as session:
        began = clock()
        Executor(session).hold(HELD)
        return clock() - began, planned


def many_rows(rounds: int) -> list[Row]:
    """Ratios of 20 balls to one."""
    rows = []
    for engine in ("pybullet", *(("mujoco",) if has_mujoco() else ())):
        measured(1, engine)  # imports, caches: does not count
        pairs = [(measured(1, engine), measured(20, engine)) for _ in range(rounds)]
        ticks = tuple(many[0] / one[0] for one, many in pairs)
        plans = tuple(many[1] / one[1] for one, many in pairs)
        rows.append(Row(f"tick with 20 balls / with one, {engine}", ticks, "x", 3.0, "held still, without recording"))
        rows.append(Row(f"plan with 20 balls / with one, {engine}", plans, "x", None, "whole task"))
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.many", description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="of every measurement; the median is printed (default 3)")
    print(markdown(many_rows(parser.parse_args().rounds)))
