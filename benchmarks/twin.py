"""Bare physics: a PyBullet world with 200 solver iterations that repeats the commands of a run.

Its `stepSimulation` is the unit of the budgets, whatever engine and settings the measured run has: a faster engine
changes no budget. The reference run has 200 iterations, too. Every `BLOCK` ticks it pauses, and its twin takes the same
steps with the same commands, bit for bit; only `stepSimulation` is timed. A twin of a run with other physics would not
do: the same commands would soon let the cup slip.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Final

from manipcli.control.command import JointCommand
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines.pybullet import PybulletEngine

ITERATIONS: Final = 200
REFERENCE: Final = ("simulation.engine=pybullet", f"simulation.pybullet.solver_iterations={ITERATIONS}")
"""Settings of the reference run, which is also PyBullet before the number of iterations followed from the scene."""
BLOCK: Final = 250
"""Ticks between two pauses of a run for its twin."""
clock = time.thread_time
"""Of the thread of the loop: other processes change it less than wall time, and on an idle machine it is the same."""


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
