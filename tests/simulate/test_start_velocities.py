"""A world can begin in motion: what was given as velocities is read back, and moves the bodies by that."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position

ROOT = Path(__file__).parents[2]
STEP = 1e-3


@pytest.mark.parametrize("name", ["pybullet", "mujoco"])
def test_velocities_of_the_start(tmp_path: Path, name: str) -> None:
    """A tilted cup, whose centre is above its frame O, and a wrist in free space without gravity."""
    pytest.importorskip(name)
    file = tmp_path / "t.yaml"
    file.write_text(
        f"task: t\nrobot: {ROOT}/robots/differential_wrist/robot.yaml\n"
        f"controllers: {ROOT}/controllers/differential_wrist.yaml\n"
        "simulation: {gravity: [0, 0, 0]}\n"
        "scene:\n  cup: {cup: {radius: 3 cm, height: 10 cm, wall: 3 mm}, mass: 100 g,\n"
        "    pose: {xyz: [2, 1, 1], rpy: [0.3, 0.2, 0.1]}}\n"
        "steps: [{wait: 1 s}]\n"
    )
    task = load_task(file, allow_outside=True)
    joints = np.array([0.1, -0.2])
    twist = np.array([[0.3, -0.2, 0.1, 0.5, 0.7, -0.4]])
    settings = EngineSettings(STEP, 1, start_position(task), velocity=joints, twists=twist)
    engine = ENGINES[name].open(task.robot, task.scene, settings)
    try:
        state = engine.read().map(np.copy)
        np.testing.assert_allclose(state.velocity, joints, atol=1e-12)
        np.testing.assert_allclose(state.body_linear, twist[:, :3], atol=1e-12)
        np.testing.assert_allclose(state.body_angular, twist[:, 3:], atol=1e-12)
        engine.advance()
        moved = engine.read().body_position[0] - state.body_position[0]
        np.testing.assert_allclose(moved, STEP * twist[0, :3], atol=1e-6)
    finally:
        engine.close()
