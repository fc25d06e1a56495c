"""`compat` of the robot file reaches the controllers of a run."""

from pathlib import Path

import numpy as np
import pytest

from manipcli.control.controller import JointState
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.plan.trajectory import JointTrajectory
from manipcli.run.execute import build_manager
from manipcli.task.load_task import load_task

TASK = Path(__file__).parents[2] / "tasks" / "home.yaml"
PERIOD, ERROR, I_GAIN = 1e-3, 0.01, 50.0


def first_command(compat: str, gain: float) -> float:
    """What joint_1 is commanded on the first tick of an error [N m], beside p e: the same for both."""
    gains = f"controllers.arm_controller.gains.joint_1.i={gain}"
    manager = build_manager(load_task(TASK, overrides=[f"robot.compat={compat}", gains]))
    arm = manager["arm_controller"]
    assert isinstance(arm, JointTrajectoryController)
    n = len(arm.joints)
    rest = JointState(np.zeros(n), np.zeros(n), np.zeros(n))
    arm.update(0.0, PERIOD, rest)
    target = np.zeros((1, n))
    target[0, 0] = ERROR
    points = np.vstack([target, target])
    arm.send_goal(JointTrajectory.of_arrays(names=arm.joints, times=np.array([0.0, 1.0]), positions=points))
    return float(arm.update(PERIOD, PERIOD, rest).command[0])


@pytest.mark.slow
def test_the_integral_acts_one_step_earlier_by_the_rules_of_ros_1() -> None:
    assert first_command("ros1", 0.0) == first_command("ros2", 0.0)
    early = first_command("ros1", I_GAIN) - first_command("ros2", I_GAIN)
    assert early == pytest.approx(I_GAIN * ERROR * PERIOD, rel=1e-6)
