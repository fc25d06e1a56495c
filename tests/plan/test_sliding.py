"""The force that slides a body is mu m g, and what catches on an edge is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.control.controllers.gripper import GripperSpec
from manipcli.core.errors import NotPlannable
from manipcli.plan.hand import closing_speed
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.sliding import resistance
from manipcli.plan.steps.push import PushSpec, candidates
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: t
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
simulation: {{gravity: [0.4, 0, -9]}}
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true, friction: 0.8}}
  tray: {{tray: {{size: [12 cm, 12 cm, 5 cm]}}, mass: 500 g, rests_on: table, at: [0.45, 0.1], friction: 0.5}}
  ball: {{sphere: {{radius: 2 cm}}, mass: 200 g, inside: tray}}
  flush: {{box: {{size: [12 cm, 12 cm, 1 mm]}}, pose: {{xyz: [0.65, 0.1, 0.1995]}}, fixed: true}}
  mat: {{box: {{size: [12 cm, 12 cm, 1 mm]}}, rests_on: table, at: [0.45, -0.15], fixed: true}}
steps: [{{wait: 1 s}}]
"""


def test_push_against_friction_and_over_edges(tmp_path: Path) -> None:
    file = tmp_path / "t.yaml"
    file.write_text(TASK)
    task = load_task(file, allow_outside=True)
    (gripper,) = (spec for spec in task.controllers.controllers.values() if isinstance(spec, GripperSpec))
    planner = Planner(
        task.robot, task.scene, period=1e-3, rng=np.random.default_rng(1), gripper_joints=gripper.joints,
        gripper_speed=closing_speed(task.robot, gripper.joints, gripper.speed),
    )  # fmt: skip
    state = PlanningState(start_position(task), tuple(body.X_WO for body in task.scene.movable))

    friction, downhill = 0.5 * 0.8 * 0.7 * 9.0, 0.7 * 0.4
    for axis, least in (([1, 0, 0], friction - downhill), ([-1, 0, 0], friction + downhill), ([0, 1, 0], friction)):
        assert resistance(planner, state, "tray", np.array(axis, dtype=float)) == pytest.approx(least)
    least = friction - downhill
    candidates(PushSpec(object="tray", by=0.1, direction=(1, 0), force=1.01 * least), planner, state)
    with pytest.raises(NotPlannable, match=r"friction holds it with 2\.24 N"):
        candidates(PushSpec(object="tray", by=0.1, direction=(1, 0), force=0.99 * least), planner, state)

    candidates(PushSpec(object="tray", onto="flush"), planner, state)
    with pytest.raises(NotPlannable, match="the edge of 'mat', 1 mm above"):
        candidates(PushSpec(object="tray", onto="mat"), planner, state)
