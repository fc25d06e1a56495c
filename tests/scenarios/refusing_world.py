"""A task that is planned for a known world and run in another one, which can change when a step begins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.judge.verdict import Verdict
from manipcli.record.read.reading import read_recording
from manipcli.record.recording import Recording
from manipcli.run import execute
from manipcli.run.libraries import load_libraries
from manipcli.simulate.engines import ENGINES
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import Plan, plan_task
from manipcli.task.task import GroundTruth, Task

MISSING = pytest.mark.skipif(bool(ENGINES["mujoco"].missing()), reason="the worlds are changed in MuJoCo")
ROOT = Path(__file__).parents[2]


class Refuser:
    """Follows a run in MuJoCo, and changes its world when a step begins."""

    def __init__(self, task: Task, when: str, change: Callable[[Refuser], None]) -> None:
        self._bodies = [body.name for body in task.true.scene.movable]
        self.n, self._when, self._change = len(task.robot.joint_names), when, change
        self.forces: list[Callable[[], None]] = []

    def activity(self, what: str) -> None: ...
    def warned(self, findings: object) -> None: ...
    def tick(self, simulated_time: float, wall: float) -> None: ...
    def step_ended(self, outcome: object) -> None: ...
    def message(self, text: str, *, detail: bool) -> None: ...

    def step_started(self, step: Any, index: int, total: int) -> None:
        if step.id == self._when:
            self._change(self)

    def opened(self, robot: Any, scene: Any, settings: Any) -> Any:
        engine: Any = ENGINES["mujoco"].open(robot, scene, settings)
        self.data, self.model = engine._data, engine._model
        advance = engine.advance

        def forced() -> None:
            for force in self.forces:
                force()
            advance()

        engine.advance = forced
        return engine

    def body(self, name: str) -> int:
        return int(self.model.jnt_bodyid[self.n + self._bodies.index(name)])

    def shift(self, name: str, by: Sequence[float]) -> None:
        k = self.n + 7 * self._bodies.index(name)
        self.data.qpos[k : k + 3] += by

    def push(self, name: str, force: Sequence[float], torque: Sequence[float] = (0, 0, 0)) -> None:
        self.data.xfrc_applied[self.body(name)] = [*force, *torque]

    def friction(self, name: str, mu: float) -> None:
        self.model.geom_friction[self.model.geom_bodyid == self.body(name), 0] = mu

    def tug(self, name: str, force: Sequence[float]) -> None:
        """A force until it has moved the body by 6 cm."""
        k, data = self.body(name), self.data
        there = data.xpos[k].copy()

        def pull() -> None:
            data.xfrc_applied[k, :3] = np.array(force) * (np.linalg.norm(data.xpos[k] - there) < 0.06)

        self.forces.append(pull)

    def jam(self, damping: float = 1e6, friction: float = 0.0, spring: float = 0.0) -> None:
        """The last two joints, of a hand, hardly move."""
        hand = slice(self.n - 2, self.n)
        self.model.dof_damping[hand] += damping
        self.model.dof_frictionloss[hand] += friction
        self.model.jnt_stiffness[hand] += spring

    def tie(self, name: str, to: int | None = None) -> None:
        """A spring to where it is, in the world or on a link [its body in MuJoCo]."""
        k, data = self.body(name), self.data
        R, p = (np.eye(3), np.zeros(3)) if to is None else (data.xmat[to].reshape(3, 3).copy(), data.xpos[to].copy())
        there, mass = R.T @ (data.xpos[k] - p), self.model.body_mass[k]

        def pull() -> None:
            R, p = (np.eye(3), np.zeros(3)) if to is None else (data.xmat[to].reshape(3, 3), data.xpos[to])
            v = data.cvel[k, 3:]
            data.xfrc_applied[k, :3] = mass * (1e4 * (p + R @ there - data.xpos[k]) - 150.0 * v + [0, 0, 9.81])

        self.forces.append(pull)

    def hold(self, name: str) -> None:
        """Its velocity is 0 at every tick, and its place the same, whatever pushes it."""
        k, data = self._bodies.index(name), self.data
        at, by = slice(self.n + 7 * k, self.n + 7 * k + 7), slice(self.n + 6 * k, self.n + 6 * k + 6)
        there = data.qpos[at].copy()

        def stay() -> None:
            data.qpos[at], data.qvel[by] = there, 0.0

        self.forces.append(stay)

    def finger(self) -> int:
        return int(self.model.jnt_bodyid[self.n - 2])


def fixed(name: str, size: str, xyz: str) -> tuple[str, str]:
    """A body that only the true world has."""
    return "scene:\n", f"scene:\n  {name}: {{box: {{size: [{size}]}}, pose: {{xyz: [{xyz}]}}, fixed: true}}\n"


Change = Callable[[Refuser], None]


@dataclass(frozen=True)
class World:
    """Steps for a known world; how the true one differs; and in which step it refuses."""

    verb: str
    name: str
    fails: str
    true: tuple[str | tuple[str, str], ...] = ()
    when: str = ""
    change: Change = lambda _: None
    says: str = ""


@dataclass
class Prepared:
    """A task with its truth, and its plan; see `manipcli.run.prepared`."""

    task: Task
    plan: Plan

    def load(self, path: Path, **_: object) -> Task:
        return self.task

    def take_plan(self, task: Task) -> Plan:
        return self.plan


_planned: dict[str, tuple[Task, Plan]] = {}  # by text; a task without re-planning does not change its plan


def run(world: World, text: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Verdict, Recording, Task]:
    """Runs a task of the known world in the true one."""
    file = folder / "task.yaml"
    planned = _planned.get(text)
    if planned is None:
        file.write_text(text, encoding="utf-8")
        known = load_task(file)
        load_libraries(known)
        planned = known, plan_task(known)
        if "replan: false" in text:
            _planned[text] = planned
    task, plan = planned
    if world.true:
        for change in world.true:
            if isinstance(change, tuple):
                assert change[0] in text
                text = text.replace(*change, 1)
        file.write_text(text, encoding="utf-8")
        other = load_task(file, overrides=[each for each in world.true if isinstance(each, str)])
        task = replace(task, truth=GroundTruth(other.robot, other.scene, other.controllers_file, other.sensors))
    refuser = Refuser(task, world.when, world.change)
    changed = {"mujoco": replace(ENGINES["mujoco"], open=refuser.opened)}
    monkeypatch.setattr(execute, "ENGINES", {each.name: each for each in ENGINES} | changed)
    prepared: Any = Prepared(task, plan)
    report = pipeline.run_task(file, log=folder / "log.mcap", prepared=prepared, progress=refuser)
    return report.verdict, read_recording(folder / "log.mcap"), task
