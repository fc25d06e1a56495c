"""A sample: what planner and models know, what only the world knows, and that its log says all of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.pipeline import run_task, verify_log
from manipcli.record.read.reading import open_recording
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
TASK = ROOT / "tasks" / "pick_place.yaml"


def _sample(vary: str, number: int = 0) -> Task:
    return load_task(TASK, overrides=(f"vary={vary}",), sample=number)


NOMINAL = load_task(TASK)


def test_without_a_sample_nothing_is_varied() -> None:
    task = load_task(TASK, overrides=("vary={scene.block.mass: {choice: [1 kg]}}",))
    assert task.drawn is None
    assert task.true.scene is task.scene
    assert task.true.robot is task.robot
    assert task.scene.body("block").mass == 0.08


@pytest.mark.slow
@pytest.mark.parametrize("path", ["mass", "friction", "rolling_friction", "restitution"])
def test_what_a_body_does_in_contact_is_known_to_the_world_alone(path: str) -> None:
    task = _sample(f"{{scene.block.{path}: {{choice: [0.25]}}}}")
    assert getattr(task.true.scene.body("block"), path) == 0.25
    assert getattr(task.scene.body("block"), path) == getattr(NOMINAL.scene.body("block"), path)


def test_what_is_set_is_not_drawn_but_an_offset_or_scale_is_about_it() -> None:
    vary = "{scene.block.mass: {choice: [1 kg]}, scene.block.friction: {scale: {choice: [0.5]}}, \
        scene.block.at: {choice: [[1 m, 1 m]]}, simulation.settle: {choice: [0.3 s]}}"
    words = (f"vary={vary}", "scene.block.mass=60 g", "scene.block.friction=0.8", "scene.block.at.0=0.55 m")
    task = load_task(TASK, overrides=words, sample=0)
    assert task.drawn is not None
    assert dict(task.drawn.values) == {"scene.block.friction": 0.4, "simulation.settle": 0.3}
    block = task.true.scene.body("block")
    assert (block.mass, block.friction, block.X_WO.p[0]) == (0.06, 0.4, 0.55)


def test_a_file_names_the_sample_of_a_run_without_one(tmp_path: Path) -> None:
    vary = "vary={simulation.settle: {grid: [0.3 s, 0.4 s, 0.5 s]}, simulation.gravity: {choice: [[0, 0, -9.7]]}}"

    def settle(sample: int | None, *words: str) -> float | None:
        task = load_task(TASK, overrides=(vary, *words), sample=sample)
        return None if task.drawn is None else task.true.scene.gravity[2] + task.spec.simulation.settle

    assert settle(None) is None
    assert settle(None, "sample=1") == settle(1) == pytest.approx(-9.3)
    assert settle(2, "sample=1") == settle(2) == pytest.approx(-9.2)
    with pytest.raises(InvalidInput, match="there is no sample 1: task 'pick_place' has no `vary:`"):
        load_task(TASK, overrides=("sample=1",))


def test_samples_count_from_0() -> None:
    with pytest.raises(InvalidInput, match="there is no sample -1: samples count from 0"):
        _sample("{scene.block.mass: {choice: [1 kg]}}", -1)


def test_inertia_follows_a_varied_mass() -> None:
    task = _sample("{scene.block.mass: {scale: {choice: [3]}}}")
    heavy, light = (one.body("block").inertia for one in (task.true.scene, NOMINAL.scene))
    np.testing.assert_allclose(heavy, 3.0 * light)


@pytest.mark.slow
def test_where_a_body_is_is_planned_for() -> None:
    task = _sample("{scene.block.at: {offset: {choice: [[3 cm, -2 cm]]}}}")
    expected = NOMINAL.scene.body("block").X_WO.p + np.array([0.03, -0.02, 0.0])
    np.testing.assert_allclose(task.scene.body("block").X_WO.p, expected)
    np.testing.assert_allclose(task.true.scene.body("block").X_WO.p, expected)


def test_gains_and_gravity_and_actuators_are_known_to_the_world_alone() -> None:
    task = load_task(
        ROOT / "tasks" / "pour.yaml",
        overrides=(
            "robot.actuators={joint_1_motor: {latency: 0}}",
            "vary={robot.actuators.*.latency: {offset: {choice: [1]}}, robot.friction: {choice: [0.3]}, "
            "simulation.gravity: {choice: [[0, 0, -5]]}, controllers.*.gains.*.p: {scale: {choice: [2]}}}",
        ),
        sample=0,
    )
    assert [one.latency for one in task.robot.actuators] == [0]
    assert [one.latency for one in task.true.robot.actuators] == [1]
    assert (task.robot.friction, task.true.robot.friction) == (1.0, 0.3)
    assert (task.scene.gravity[2], task.true.scene.gravity[2]) == (-9.81, -5.0)
    known, true = (file.spec.controllers for file in (task.controllers_file, task.true.controllers))
    assert true["arm_controller"].gains["joint_1"].p == 2.0 * known["arm_controller"].gains["joint_1"].p


def test_limits_and_named_poses_of_the_robot_are_planned_for() -> None:
    task = _sample("{robot.limits.panda_joint1.acceleration: {choice: [2]}, robot.mount.xyz: {choice: [[0, 0, 1 mm]]}}")
    assert task.robot.joint("panda_joint1").limits.acceleration == 2.0
    assert task.robot.X_WB.p[2] == 0.001
    assert task.true.robot.X_WB.p[2] == 0.001


@pytest.mark.slow
def test_the_engine_gets_the_mass_and_the_plan_does_not() -> None:
    task = _sample("{scene.block.mass: {choice: [200 g]}}")
    plan, nominal = plan_task(task), plan_task(NOMINAL)
    assert plan.outline.to_json() == nominal.outline.to_json()
    settings = EngineSettings(step=0.001, substeps=1, start=plan.start.position)
    weights = []
    for scene in (NOMINAL.true.scene, task.true.scene):
        engine = ENGINES["pybullet"].open(task.true.robot, scene, settings)
        try:
            for _ in range(400):
                engine.advance()
            touching = [one for one in engine.contacts() if {one.a, one.b} == {"block", "table"}]
            weights.append(sum(one.force for one in touching))
        finally:
            engine.close()
    # The table carries m g, within what Bullet's contact still sways by after 0.4 s.
    np.testing.assert_allclose(weights, [0.08 * 9.81, 0.2 * 9.81], rtol=0.02)


SLOW_TASK = """{scene.block.at: {offset: {uniform: [-2 cm, 2 cm]}}, scene.block.mass: {uniform: [50 g, 150 g]},
controllers.arm_controller.gains.*.p: {scale: {uniform: [0.9, 1.1]}}, robot.friction: {uniform: [0.9, 1.1]}}"""


@pytest.mark.slow
def test_the_log_of_a_sample_says_what_was_drawn_and_is_simulated_again_to_the_byte(tmp_path: Path) -> None:
    log = tmp_path / "sample.mcap"
    report = run_task(TASK, overrides=(f"vary={SLOW_TASK}",), sample=5, log=log)
    drawn = report.verdict.drawn
    assert drawn is not None
    assert drawn.number == 5
    values = dict(drawn.values)
    assert len(values) == 10
    recording = open_recording(log)
    scene = json.loads(recording.attachments["scene.json"])
    (block,) = [body for body in scene["bodies"] if body["name"] == "block"]
    assert block["mass"] == values["scene.block.mass"]
    assert "mass: 0.08" in recording.attachments["task.yaml"].decode()
    assert verify_log(log).identical
