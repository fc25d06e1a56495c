"""Tasks whose straight paths are blocked pass in physics: the robot goes around, and touches nothing on its way."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import NotPlannable
from manipcli.pipeline import run_task
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

ROOT = Path(__file__).parents[2]
WALL = f"""\
task: wall
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
planner: {{type: rrt_connect, samples: 2000}}
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  wall: {{box: {{size: [0.5, 0.02, 0.3]}}, pose: {{xyz: [0.55, 0.02, 0.35]}}, fixed: true}}
  block: {{box: {{size: [4 cm, 4 cm, 5 cm]}}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}}
steps:
  - pick: {{object: block, approach: {{from: top}}, grasp: {{posture: closed, force: 7 N}}}}
  - lift: {{object: block, by: [5 cm, 8 cm]}}
  - place: {{object: block, at: [0.5, 0.2], onto: table}}
  - move: {{to: home}}
expect:
  - near: {{object: block, to: [0.5, 0.2, 0.225], within: 1 cm}}
  - no_collision: {{pairs: [[robot, table], [robot, wall], [block, wall]]}}
"""


@pytest.mark.slow
def test_a_block_is_carried_over_a_wall_in_physics(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(WALL)
    assert run_task(path, log=tmp_path / "wall.mcap").verdict.verdict == "passed"


def test_a_task_without_samples_is_refused_as_before(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(WALL.replace("samples: 2000", "samples: 0"))
    with pytest.raises(NotPlannable, match="comes within 4 mm of 'wall'"):
        plan_task(load_task(path))
