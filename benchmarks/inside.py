"""What is measured inside one process: the control loop against bare physics, planning, time-optimality.

The physics of a run is repeated in a twin world while the run goes on: every `BLOCK` ticks the run pauses, and the twin
takes the same steps with the same commands, of which only `stepSimulation` is timed. Run and twin so share whatever
else the machine does at that time, and their ratio holds on a busy machine, too.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks.table import Row
from manipcli.control.command import JointCommand
from manipcli.control.controller import ControllerOutput
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.pipeline import run_task
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path import joint_path
from manipcli.plan.rest_to_rest import rest_to_rest
from manipcli.plan.retimer import retime
from manipcli.record.write.recorder import Recorder
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.engines.pybullet import PybulletEngine
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

POUR = Path(__file__).resolve().parents[1] / "tasks" / "pour.yaml"
BLOCK = 250
"""Ticks between two pauses of a run for its twin."""
clock = time.perf_counter


@dataclass
class Cost:
    """Seconds of a run: `bare` in its twin's physics, `paused` for the twin in all, `recording` in the recorder."""

    bare: float = 0.0
    paused: float = 0.0
    recording: float = 0.0
    ticks: int = 0


class Watched(PybulletEngine):
    """The engine of a run, with its twin."""

    def __init__(self, cost: Cost, robot: RobotModel, scene: Scene, settings: EngineSettings) -> None:
        super().__init__(robot, scene, settings)
        began = clock()
        self._cost, self._commands = cost, list[Array]()
        self._twin = PybulletEngine(robot, scene, settings)
        cost.paused += clock() - began

    def write(self, command: JointCommand) -> None:
        super().write(command)
        self._commands.append(command.effort.copy())

    def advance(self) -> None:
        super().advance()
        if len(self._commands) >= BLOCK:
            self._repeat()

    def close(self) -> None:
        self._repeat()
        self._twin.close()
        super().close()

    def _repeat(self) -> None:
        """The twin takes the steps since the last pause."""
        paused, bare = clock(), 0.0
        step, client = self._twin._p.stepSimulation, self._twin._client
        command = JointCommand(len(self._commands[0]) if self._commands else 0)
        command.modes, command.version = ("effort",) * len(command.effort), 1
        for effort in self._commands:
            command.effort[:] = effort
            self._twin.write(command)
            for _ in range(self._twin._substeps):
                self._twin._motors.push()
                began = clock()
                step(client)
                bare += clock() - began
        cost = self._cost
        cost.bare += bare
        cost.ticks += len(self._commands)
        self._commands.clear()
        cost.paused += clock() - paused


def watched_run(folder: Path) -> tuple[float, Cost]:
    """Seconds of the simulate phase of the pour without the pauses, and what it is made of."""
    cost = Cost()
    member = ENGINES["pybullet"]
    watched = replace(member, open=partial(Watched, cost))
    with patch("manipcli.run.execute.ENGINES", {"pybullet": watched}):
        report = run_task(POUR, log=folder / "pour.mcap", force=True)
    return report.timing.simulate - cost.paused, cost


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
    """The simulate phase and its parts, in units of the twin's physics."""
    ratios, records, steps = [], [], []
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        folder = Path(name)
        watched_run(folder)  # imports, caches: does not count
        for _ in range(rounds):
            whole, cost = watched_run(folder)
            ratios.append(whole / cost.bare)
            steps.append(1e6 * cost.bare / cost.ticks)
            _, cost = recording(folder)
            records.append(cost.recording / cost.bare)
    rest = tuple(whole - 1.0 - record for whole, record in zip(ratios, records, strict=True))
    return [
        Row("simulate phase of the pour / bare stepSimulation", tuple(ratios), "x", 1.5, "same world, same commands"),
        Row("recording", tuple(records), "x", 0.2, "Recorder.tick and .contacts, flushes included"),
        Row("engine, control, loop", rest, "x", 0.3, "the rest above 1"),
        Row("bare stepSimulation", tuple(steps), "us", None, "for orientation"),
    ]


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
