"""Planner and controllers know the gravity that the task states; what is drawn acts in the world alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.core.units import EARTH_GRAVITY
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.pipeline import run_task, verify_log
from manipcli.run.execute import build_manager
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task, start_position
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
MOVES = f"""\
task: two_moves
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
start: home
steps:
  - move: {{to: zero}}
  - move: {{to: home}}
"""


def _task(folder: Path, more: str = "", *overrides: str, sample: int | None = None) -> Task:
    file = folder / "moves.yaml"
    file.write_text(MOVES + more)
    return load_task(file, overrides=overrides, sample=sample)


def _potential(robot: RobotModel, model: Kinematics, q: Array, g: Array) -> float:
    """U [J] = - sum m g . p over the centres of mass."""
    return -sum(
        link.inertial.mass * float(g @ (model.forward(q, link.name) @ link.inertial.X_LI).p)
        for link in robot.links
        if link.inertial is not None
    )


@dataclass
class _AtRest:
    position: Array
    velocity: Array
    effort: Array


def _held(task: Task, kinematics: Kinematics | None = None) -> Array:
    """(n) the efforts that the controllers command at the start, at rest and where their references are."""
    q = start_position(task)
    manager = build_manager(task, kinematics)
    return np.array(manager.update(0.0, _AtRest(q, np.zeros_like(q), np.zeros_like(q))).effort)


@pytest.mark.parametrize("stated", [None, (0.0, 0.0, 0.0), (0.0, 0.0, 9.81), (1.0, -2.0, -1.62)])
def test_at_rest_controllers_hold_the_slope_of_the_potential_under_the_stated_gravity(
    tmp_path: Path, stated: tuple[float, float, float] | None
) -> None:
    task = _task(tmp_path, "" if stated is None else f"simulation: {{gravity: {list(stated)}}}\n")
    q, g = start_position(task), np.array(EARTH_GRAVITY if stated is None else stated)
    model, h = Kinematics(task.robot, gravity=(0.0, 0.0, 0.0)), 1e-5
    slope = [
        (_potential(task.robot, model, q + h * e, g) - _potential(task.robot, model, q - h * e, g)) / (2 * h)
        for e in np.eye(len(q))
    ]
    commanded = [task.robot.joint_names.index(f"joint_{k}") for k in range(1, 8)]
    np.testing.assert_allclose(_held(task)[commanded], np.array(slope)[commanded], atol=1e-6)


def test_what_is_set_is_known_and_what_is_drawn_is_not(tmp_path: Path) -> None:
    moon, vary = "simulation: {gravity: [0, 0, -1.62]}\n", "vary: {simulation.gravity: {choice: [[0, 0, -3]]}}\n"
    drawn = _task(tmp_path, moon + vary, sample=0)
    assert drawn.true.scene.gravity.tolist() == [0.0, 0.0, -3.0]
    stated = _task(tmp_path, moon)
    np.testing.assert_array_equal(_held(drawn), _held(stated))
    planned = plan_task(drawn).planner.kinematics
    np.testing.assert_array_equal(_held(drawn, planned), _held(stated))
    assert planned.model.gravity.linear.tolist() == [0.0, 0.0, -1.62]


@pytest.mark.slow
@pytest.mark.parametrize("gravity", ["[0,0,0]", "[0,0,9.81]"])
def test_two_moves_pass_under_another_gravity(tmp_path: Path, gravity: str) -> None:
    file = tmp_path / "moves.yaml"
    file.write_text(MOVES)
    run = run_task(file, overrides=(f"simulation.gravity={gravity}",), log=tmp_path / "moves.mcap")
    assert run.verdict.verdict == "passed", run.verdict.text


@pytest.mark.slow
def test_a_log_whose_scene_came_from_files_is_simulated_again_under_both_its_gravities(tmp_path: Path) -> None:
    """Its scene.json holds the drawn one, its task.yaml the stated one."""
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in corners)
    (tmp_path / "block.obj").write_text(vertices + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    (tmp_path / "moves.yaml").write_text(
        MOVES.replace("  - move: {to: zero}\n  - move: {to: home}\n", "  - wait: 0.5 s\n")
        + "scene: {block: {mesh: {file: block.obj, scale: 0.1}, pose: {xyz: [0.9, 0.9, 0.5]}, fixed: true}}\n"
        + "vary: {simulation.gravity: {choice: [[0, 0, -3]]}}\n"
    )
    run_task(tmp_path / "moves.yaml", sample=0, log=tmp_path / "moves.mcap")
    assert verify_log(tmp_path / "moves.mcap", package_path=[tmp_path], allow_outside=True).identical
