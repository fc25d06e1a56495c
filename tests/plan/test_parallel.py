"""Arm and hand at the same time: the arm's path is free whatever the hand has reached."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import Plan, plan_task

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: slot
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
simulation: {{engine: kinematic}}
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  left: {{box: {{size: [0.2, 2 cm, 4 cm]}}, rests_on: table, at: [0.5, 0.037], fixed: true}}
  right: {{box: {{size: [0.2, 2 cm, 4 cm]}}, rests_on: table, at: [0.5, -0.037], fixed: true}}
steps:
  - move: {{to: closed}}
  - move: {{pose: {{xyz: [0.5, 0, 0.36], rpy: [180 deg, 0, 0]}}}}
"""
DOWN = "move: {pose: {xyz: [0.5, 0, 0.225], rpy: [180 deg, 0, 0]}, path: linear}"
UP = "move: {pose: {xyz: [0.5, 0, 0.36], rpy: [180 deg, 0, 0]}, path: linear}"


def planned(folder: Path, steps: str) -> Plan:
    (folder / "task.yaml").write_text(TASK + steps)
    return plan_task(load_task(folder / "task.yaml"))


@pytest.mark.parametrize("way", [1, -1])
def test_a_hand_that_opens_cannot_enter_a_slot_or_leave_it_meanwhile(tmp_path: Path, way: int) -> None:
    """It can open after it has left. Closed fingers have room in the slot, open ones overlap the walls."""
    together = "  - parallel:\n      - {}\n      - {}\n"
    planned(tmp_path, f"  - {DOWN}\n  - {UP}\n  - release: {{}}\n")
    with pytest.raises(NotPlannable, match=r"^step 'parallel_1/move_1': .*'(left|right)'"):
        planned(tmp_path, together.format(*[DOWN, "release: {}"][::way]))
    with pytest.raises(NotPlannable, match=r"^step 'parallel_1/release_1': .*'(left|right)'"):
        planned(tmp_path, f"  - {DOWN}\n" + together.format(*[UP, "release: {}"][::way]))


def test_both_begin_in_the_same_state_and_the_next_step_where_both_end(tmp_path: Path) -> None:
    plan = planned(
        tmp_path, f"  - {UP}\n  - parallel:\n      - move: {{to: {{panda_joint1: 0.4}}}}\n      - release: {{}}\n"
    )
    arm, hand = plan.steps[-2:]
    assert arm.start is hand.start
    assert arm.plan.end is hand.plan.end
    robot = plan.planner.robot
    end = dict(zip(robot.joint_names, arm.plan.end.position, strict=True))
    assert end["panda_joint1"] == pytest.approx(0.4)
    assert end["panda_finger_joint1"] == end["panda_finger_joint2"] == pytest.approx(0.04)
    still = [k for k, name in enumerate(robot.joint_names) if name != "panda_joint1" and "finger" not in name]
    assert np.array_equal(arm.start.position[still], arm.plan.end.position[still])
