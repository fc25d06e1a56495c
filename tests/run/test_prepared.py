"""A sample that is run with what was loaded and planned before it is the same run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from manipcli.run.prepared import same_for_planner
from manipcli.task.load_task import load_written

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: varied
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic}}
scene:
  desk: {{box: {{size: [0.6, 1.0, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
  cup: {{box: {{size: [0.06, 0.06, 0.1]}}, mass: 150 g, rests_on: desk, at: [0.75, 0.0], friction: 0.8}}
steps:
  - move: {{to: home}}
  - wait: 0.1 s
"""
KEPT = (
    "scene.cup.mass: {uniform: [50 g, 300 g]}",
    "scene.cup.friction: {uniform: [0.5, 1.0]}",
    "simulation.gravity: {scale: {uniform: [0.99, 1.01]}}",
    "controllers.arm_controller.gains.joint_1.p: {scale: {uniform: [0.9, 1.1]}}",
)
CHANGED = (
    "scene.cup.at: {offset: {uniform: [-1 cm, 1 cm]}}",
    "scene.cup.box.size: {scale: {uniform: [0.9, 1.1]}}",
    "simulation.settle: {uniform: [0.1, 0.2]}",
)


def written(folder: Path, *varied: str) -> Path:
    file = folder / "varied.yaml"
    file.write_text("\n".join([TASK.rstrip(), "vary:", *(f"  {line}" for line in varied), ""]))
    return file


@pytest.mark.parametrize("varied", [(line,) for line in (*KEPT, *CHANGED)] + [KEPT, (*KEPT, CHANGED[0])])
def test_a_sample_has_the_plan_of_the_task_only_if_it_is_the_same_for_the_planner(
    tmp_path: Path, varied: tuple[str, ...]
) -> None:
    task = load_written(written(tmp_path, *varied))
    sample = task.sample(3)
    assert sample.truth is not None
    assert same_for_planner(sample, task.task) == (not {*varied} & {*CHANGED})


PROGRAM = """
import sys
from pathlib import Path
import manipcli.pipeline
from manipcli.pipeline import run_task
from manipcli.run import prepared
from manipcli.task import plan_task
file, folder = Path(sys.argv[1]), Path(sys.argv[2])
ready = prepared.prepare(file)
planned = ready.plan
assert run_task(file, sample=3, log=folder / "alone.mcap").verdict.verdict == "passed"
assert run_task(file, sample=3, log=folder / "prepared.mcap", prepared=ready).verdict.verdict == "passed"
assert (folder / "alone.mcap").read_bytes() == (folder / "prepared.mcap").read_bytes()
assert ready.plan is None  # a planner is for one run
if planned is not None:
    ready.plan, manipcli.pipeline.plan_task = planned, None
    run_task(file, sample=4, log=folder / "planned.mcap", prepared=ready)
file.write_text(file.read_text().replace("wait: 0.1 s", "wait: 0.2 s"))
ready.plan = planned
manipcli.pipeline.plan_task = plan_task.plan_task
run_task(file, sample=3, log=folder / "old.mcap", prepared=ready, force=True)
run_task(file, sample=3, log=folder / "new.mcap", force=True)
assert (folder / "old.mcap").read_bytes() == (folder / "new.mcap").read_bytes()
print(planned is not None)
"""
"""In its own process, as `prepare` asks for."""


@pytest.mark.parametrize(("varied", "planned"), [(KEPT, True), ((*KEPT, CHANGED[0]), False)])
def test_a_prepared_sample_has_the_bytes_of_one_that_is_run_alone(
    tmp_path: Path, varied: tuple[str, ...], planned: bool
) -> None:
    """With the plan of the task as written where nothing else differs; after a change of a file, both are new."""
    words = [sys.executable, "-c", PROGRAM, written(tmp_path, *varied), tmp_path]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.stdout == f"{planned}\n", done.stderr
