"""The hand lies flat on the face of a box that it pushes, inside the cone of friction about the face."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.controllers.gripper import GripperSpec
from manipcli.core.errors import NotPlannable
from manipcli.plan.hand import closing_speed
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.steps.push import RESERVE, PushSpec, facing
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: t
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
scene:
  box: {{box: {{size: [8 cm, 6 cm, 4 cm]}}, mass: 1 kg, rests_on: floor, at: [0.5, 0], yaw: 30 deg, friction: 0.5}}
  can: {{cylinder: {{radius: 3 cm, height: 5 cm}}, mass: 1 kg, rests_on: floor, at: [0.5, 0.3]}}
steps: [{{wait: 1 s}}]
"""


def unit(angle: float) -> np.ndarray:
    return np.array([math.cos(angle), math.sin(angle), 0.0])


def test_the_hand_is_flat_on_the_nearest_face(tmp_path: Path) -> None:
    file = tmp_path / "t.yaml"
    file.write_text(TASK)
    task = load_task(file, allow_outside=True)
    (gripper,) = (spec for spec in task.controllers.controllers.values() if isinstance(spec, GripperSpec))
    planner = Planner(
        task.robot, task.scene, period=1e-3, rng=np.random.default_rng(1), gripper_joints=gripper.joints,
        gripper_speed=closing_speed(task.robot, gripper.joints, gripper.speed),
    )  # fmt: skip
    state = PlanningState(start_position(task), tuple(body.X_WO for body in task.scene.movable))
    cone = math.atan(RESERVE * 0.5 * task.robot.friction)
    for quarter in range(4):
        face = math.radians(30.0) + quarter * math.pi / 2.0
        for off in (-0.98 * cone, 0.0, 0.98 * cone):
            normal = facing(PushSpec(object="box", by=0.1), planner, state, unit(face + off))
            np.testing.assert_allclose(normal, unit(face), atol=1e-9)
    with pytest.raises(NotPlannable, match="would rotate"):
        facing(PushSpec(object="box", by=0.1), planner, state, unit(math.radians(30.0) + 1.02 * cone))
    axis = unit(0.3)
    np.testing.assert_array_equal(facing(PushSpec(object="can", by=0.1), planner, state, axis), axis)
