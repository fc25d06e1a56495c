"""A body that is put elsewhere is read there with its velocity, and moves on from there as Newton says."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.geometry import Transform
from manipcli.simulate.engine import Engine, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position

ROOT = Path(__file__).parents[2]
STEP = 1e-3
THERE = Transform.of(xyz=(0.7, -1.2, 3.0), rpy=(0.4, -0.8, 2.1))
FIRST = Transform.of(xyz=(2.0, 1.0, 2.0), rpy=(0.3, 0.2, 0.1))


@contextmanager
def world(folder: Path, name: str, *, cup: Transform = FIRST) -> Iterator[Engine]:
    """A cup, whose centre is above its frame O, a box far from it, and a small robot."""
    pytest.importorskip("mujoco" if name == "mujoco" else "numpy")
    xyz, rpy = cup.p.tolist(), cup.rpy.tolist()
    (folder / "t.yaml").write_text(
        f"task: t\nrobot: {ROOT}/robots/differential_wrist/robot.yaml\n"
        f"controllers: {ROOT}/controllers/differential_wrist.yaml\n"
        "scene:\n  cup: {cup: {radius: 3 cm, height: 10 cm, wall: 3 mm}, mass: 100 g,\n"
        f"    pose: {{xyz: {xyz}, rpy: {rpy}}}}}\n"
        "  brick: {box: {size: [0.1, 0.1, 0.1]}, mass: 1 kg, pose: {xyz: [-2, 0, 2]}}\n"
        "steps: [{wait: 1 s}]\n"
    )
    task = load_task(folder / "t.yaml", allow_outside=True)
    engine = ENGINES[name].open(task.robot, task.scene, EngineSettings(STEP, 1, start_position(task)))
    try:
        yield engine
    finally:
        engine.close()


@pytest.mark.parametrize("name", ["pybullet", "mujoco", "kinematic"])
def test_a_placed_body_is_read_there_and_the_others_where_they_were(tmp_path: Path, name: str) -> None:
    with world(tmp_path, name) as engine:
        for _ in range(20):
            engine.advance()
        before = engine.read().map(np.copy)
        pose, twist = engine.body_state("cup")
        np.testing.assert_allclose(pose.p, before.body_position[0], atol=1e-12)
        np.testing.assert_allclose(twist[:3], before.body_linear[0], atol=1e-9)

        given = np.array([0.3, -0.2, 0.1, 0.5, 0.7, -0.4]) * (name != "kinematic")
        for twist in (np.zeros(6), given):
            engine.place("cup", THERE, twist)
            pose, moving = engine.body_state("cup")
            state = engine.read()
            np.testing.assert_allclose(pose.p, THERE.p, atol=1e-12)
            np.testing.assert_allclose(pose.R, THERE.R, atol=1e-12)
            np.testing.assert_allclose(moving, twist, atol=1e-12)
            np.testing.assert_allclose(state.body_position[0], THERE.p, atol=1e-12)
            np.testing.assert_allclose(np.abs(state.body_quat_xyzw[0] @ THERE.quat_xyzw), 1.0, atol=1e-12)
            np.testing.assert_allclose(state.body_linear[0], twist[:3], atol=1e-12)
            np.testing.assert_allclose(state.body_angular[0], twist[3:], atol=1e-12)
            for now, then in ((state.body_position, before.body_position), (state.body_linear, before.body_linear)):
                np.testing.assert_array_equal(now[1], then[1])
            np.testing.assert_array_equal(state.position, before.position)


@pytest.mark.parametrize("name", ["pybullet", "mujoco"])
def test_a_placed_body_falls_as_in_closed_form(tmp_path: Path, name: str) -> None:
    """Of explicit-position, implicit-velocity steps: v = v0 - g t, and z = z0 + v0 t - g t (t + h) / 2 exactly."""
    ticks, rise = 300, 1.5
    time = ticks * STEP
    with world(tmp_path, name) as engine:
        for _ in range(50):
            engine.advance()
        engine.place("cup", Transform.of(xyz=THERE.p), np.array([0.2, 0.0, rise, 0.0, 0.0, 0.0]))
        for _ in range(ticks):
            engine.advance()
        pose, twist = engine.body_state("cup")
    np.testing.assert_allclose(twist[:3], [0.2, 0.0, rise - 9.81 * time], atol=1e-9)
    fallen = THERE.p + np.array([0.2 * time, 0.0, rise * time - 9.81 * time * (time + STEP) / 2])
    np.testing.assert_allclose(pose.p, fallen, atol=1e-9)


@pytest.mark.parametrize("name", ["pybullet", "mujoco", "kinematic"])
def test_a_placed_body_goes_on_like_one_that_starts_there(tmp_path: Path, name: str) -> None:
    floor = Transform.of(xyz=(-2.0, 0.0, 2.05), rpy=(0.0, 0.0, 0.3))  # on the brick, with which it falls
    with world(tmp_path, name) as placed, world(tmp_path, name, cup=floor) as started:
        placed.place("cup", floor, np.zeros(6))
        for _ in range(200):
            placed.advance()
            started.advance()
        there, expected = placed.read().map(np.copy), started.read().map(np.copy)
    np.testing.assert_allclose(there.body_position, expected.body_position, atol=1e-9)
    np.testing.assert_allclose(there.body_linear, expected.body_linear, atol=1e-7)
