"""What is measured inside one process: the control loop against bare physics, engines, planning, time-optimality."""

from __future__ import annotations

import importlib.util
import math
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks.table import Row
from benchmarks.twin import ITERATIONS, REFERENCE, Cost, Watched, clock
from manipcli.control.controller import ControllerOutput
from manipcli.model.state import Contact, WorldState
from manipcli.pipeline import run_task
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path import joint_path
from manipcli.plan.rest_to_rest import rest_to_rest
from manipcli.plan.retimer import retime
from manipcli.record.write.recorder import Recorder
from manipcli.simulate.engines import ENGINES
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

POUR = Path(__file__).resolve().parents[1] / "tasks" / "pour.yaml"


def watched_run(folder: Path) -> tuple[float, Cost]:
    """Seconds of the simulate phase of the reference run of the pour without the pauses, and what it is made of."""
    cost = Cost()
    watched = replace(ENGINES["pybullet"], open=partial(Watched, cost))
    with patch("manipcli.run.execute.ENGINES", {"pybullet": watched}):
        whole = simulate_phase(folder, REFERENCE)
    return whole - cost.paused, cost


def simulate_phase(folder: Path, overrides: tuple[str, ...] = ()) -> float:
    """Seconds of the simulate phase of the pour, by `clock`."""
    with patch("time.perf_counter", clock):
        return run_task(POUR, log=folder / "pour.mcap", force=True, overrides=overrides).timing.simulate


def recording(folder: Path) -> tuple[float, Cost]:
    """A run whose calls of the recorder are timed; only `recording` of its cost is to be looked at."""
    spent = 0.0
    tick, contacts = Recorder.tick, Recorder.contacts

    def timed_tick(self: Recorder, k: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        nonlocal spent
        began = clock()
        tick(self, k, state, outputs)
        spent += clock() - began

    def timed_contacts(self: Recorder, k: int, touching: Sequence[Contact]) -> None:
        nonlocal spent
        began = clock()
        contacts(self, k, touching)
        spent += clock() - began

    with patch.multiple(Recorder, tick=timed_tick, contacts=timed_contacts):
        whole, cost = watched_run(folder)
    cost.recording = spent
    return whole, cost


def simulate_rows(rounds: int) -> list[Row]:
    """The simulate phase and its parts, in units of bare physics."""
    ratios, references, records, steps = [], [], [], []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        folder = Path(name)
        watched_run(folder)  # imports, caches: does not count
        for _ in range(rounds):
            whole, cost = watched_run(folder)
            ratios.append(simulate_phase(folder) / cost.bare)
            references.append(whole / cost.bare)
            steps.append(1e6 * cost.bare / cost.ticks)
            _, cost = recording(folder)
            records.append(cost.recording / cost.bare)
    rest = tuple(whole - 1.0 - record for whole, record in zip(references, records, strict=True))
    bare = f"PyBullet with {ITERATIONS} iterations"
    return [
        Row("simulate phase of the pour / bare stepSimulation", tuple(ratios), "x", 1.5, f"bare: {bare}"),
        Row(f"the same with {ITERATIONS} iterations", tuple(references), "x", 1.5, "same world, same commands"),
        Row("its part for recording", tuple(records), "x", 0.2, "Recorder.tick and .contacts, flushes included"),
        Row("its part for engine, control, loop", rest, "x", 0.3, "the rest above 1"),
        Row("bare stepSimulation", tuple(steps), "us", None, "for orientation"),
    ]


def engine_rows(rounds: int) -> list[Row]:
    """Whole simulate phases of the pour, in turn: PyBullet as it is, with 200 iterations, and MuJoCo."""
    engines = {"reference": REFERENCE, "pybullet": ("simulation.engine=pybullet",)}
    if has_mujoco():
        engines["mujoco"] = ("simulation.engine=mujoco",)
    seconds: dict[str, list[float]] = {name: [] for name in engines}
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        folder = Path(name)
        for k in range(rounds + 1):
            for engine, overrides in engines.items():
                phase = simulate_phase(folder, overrides)
                if k > 0:  # the first round is for imports and caches
                    seconds[engine].append(phase)

    def ratios(engine: str) -> tuple[float, ...]:
        return tuple(one / other for one, other in zip(seconds[engine], seconds["reference"], strict=True))

    note = f"against PyBullet with {ITERATIONS} iterations"
    rows = [Row("simulate phase of the pour, PyBullet", ratios("pybullet"), "x", 1 / 1.2, note)]
    if "mujoco" in engines:
        rows.append(Row("simulate phase of the pour, MuJoCo", ratios("mujoco"), "x", 1 / 2.8, note))
    return rows


def has_mujoco() -> bool:
    """Whether the rows of MuJoCo can be measured; prints a note if not."""
    found = importlib.util.find_spec("mujoco") is not None and any(member.name == "mujoco" for member in ENGINES)
    if not found:
        print("no rows for MuJoCo: it is not installed (extra manipcli[mujoco])", file=sys.stderr)
    return found


def plan_row(rounds: int) -> Row:
    """Planning of the whole pour."""
    task = load_task(POUR)
    plan_task(task)
    return Row("plan of the whole pour", tuple(_seconds(lambda: plan_task(task)) for _ in range(rounds)), "s", 0.5)


def optimality_rows() -> list[Row]:
    """The 1 rad move with v <= 100 rad/s, a <= 100 rad/s2 and no jerk limit takes 0.2 s at best."""
    hundred, unbounded = np.array([100.0]), np.array([np.inf])
    limits = MotionLimits(("joint",), -unbounded, unbounded, hundred, hundred, unbounded)
    best = 2.0 * math.sqrt(1.0 / 100.0)
    straight = rest_to_rest([0.0], [1.0], limits, period=0.001).duration / best
    along = retime(joint_path([[0.0], [0.5], [1.0]]), limits, period=0.001).duration / best
    return [
        Row("1 rad from rest to rest / 0.2 s", (straight,), "x", 1.01, "ruckig, on ticks of 1 ms"),
        Row("1 rad along a path / 0.2 s", (along,), "x", 1.01, "toppra, on ticks of 1 ms"),
    ]


def _seconds(work: Callable[[], object]) -> float:
    began = clock()
    work()
    return clock() - began
