"""Gains that cannot be stable at the control period are told before anything runs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from manipcli.flow.check import check_files
from manipcli.flow.gains import gain_findings
from manipcli.flow.load import load_task
from manipcli.model.kinematics import Kinematics

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["pour", "pour_iiwa", "home", "pick_place"])
def test_the_gains_of_the_tasks_here_neither_ring_nor_diverge(name: str) -> None:
    assert gain_findings(load_task(ROOT / "tasks" / f"{name}.yaml")) == ()


def test_too_much_damping_on_a_light_joint_is_told_with_the_gain_that_would_do(tmp_path: Path) -> None:
    task = load_task(ROOT / "tasks" / "pour.yaml", overrides=["controllers.arm_controller.gains.joint_7.d=5"])
    (finding,) = gain_findings(task)
    assert finding.severity == "warning"
    assert finding.place is not None
    assert "joint_7" in finding.message
    assert "is unstable" in finding.message
    # The bound by an independent way: the joint's acceleration under a unit torque on it alone.
    robot = task.robot
    home = np.zeros(len(robot.joint_names))
    pose = robot.pose("home")
    home[robot.indices(pose.joints)] = pose.positions
    k = robot.joint_names.index("joint_7")
    push = np.zeros(len(home))
    push[k] = 1.0
    inertia = 1.0 / np.linalg.solve(Kinematics(robot).mass_matrix(home), push)[k]
    (told,) = re.findall(r"unstable from ([0-9.]+)", str(finding.hint))
    np.testing.assert_allclose(float(told), 2.0 * inertia / task.spec.simulation.control_period, rtol=0.01)


def test_check_tells_it(tmp_path: Path) -> None:
    controllers = (
        (ROOT / "controllers" / "arm7_hand3.yaml")
        .read_text()
        .replace("joint_7: {p: 30, d: 0.4}", "joint_7: {p: 30, d: 5}")
    )
    (tmp_path / "controllers.yaml").write_text(controllers)
    text = (ROOT / "tasks" / "home.yaml").read_text()
    text = text.replace("../robots", str(ROOT / "robots")).replace("../controllers/arm7_hand3.yaml", "controllers.yaml")
    task = tmp_path / "home.yaml"
    task.write_text(text)
    assert any("joint_7" in finding.message and "unstable" in finding.message for finding in check_files([task]))
