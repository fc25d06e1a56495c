"""Gains that cannot work are told before anything runs, with the number that would do."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic
from manipcli.model.kinematics import Kinematics
from manipcli.preflight.check_files import check_files
from manipcli.preflight.findings import preflight_findings
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
HOME = ROOT / "tasks" / "home.yaml"


def findings(*overrides: str, task: Path = HOME) -> tuple[Diagnostic, ...]:
    return preflight_findings(load_task(task, overrides=overrides))


@pytest.mark.parametrize(
    "name",
    ["home", *(pytest.param(name, marks=pytest.mark.slow) for name in ("pour", "pour_iiwa", "pick_place"))],
)
def test_the_gains_of_the_tasks_here_give_no_doubt(name: str) -> None:
    assert findings(task=ROOT / "tasks" / f"{name}.yaml") == ()


@pytest.mark.slow
def test_too_much_damping_is_told_with_the_gain_that_would_do() -> None:
    (finding,) = findings("controllers.arm_controller.gains.joint_7.d=5")
    told = re.fullmatch(
        r"joint_7: d 5 is unstable, the limit is ([0-9.]+) at 1 ms; least inertia ([0-9.]+) kg m2 over .*",
        finding.message,
    )
    assert told is not None
    assert finding.severity == "warning"
    assert finding.code == "CTRL150"
    assert finding.place is not None
    assert "joint_7: {p: 30, d: 0.4}" in Path(finding.place.file).read_text().splitlines()[finding.place.line - 1]
    # The inertia in another way: the acceleration of the joint under a unit torque on it alone, at home.
    robot = load_task(HOME).robot
    home = np.zeros(len(robot.joint_names))
    pose = robot.pose("home")
    home[robot.indices(pose.joints)] = pose.positions
    k = robot.joint_names.index("joint_7")
    push = np.zeros(len(home))
    push[k] = 1.0
    inertia = 1.0 / np.linalg.solve(Kinematics(robot).mass_matrix(home), push)[k]
    assert float(told[2]) == pytest.approx(inertia, rel=0.05)
    assert float(told[1]) == pytest.approx(2.0 * inertia / 1e-3, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        (["arm_controller.gains.joint_1.d=0.1"], r"CTRL153.*joint_1: p 300 with d 0.1 oscillates at 2\.5\d Hz"),
        (["arm_controller.gains.joint_7.d=2.9"], r"CTRL150.*joint_7: d 2.9 rings at 1 ms"),
        (["arm_controller.gains.joint_7.p=8000"], r"CTRL150.*joint_7: p 8000 with d 0.4 is unstable, the limit is \d"),
        (
            ["arm_controller.gains.joint_6.i=90000"],
            r"CTRL150.*joint_6: i 90000 with p .* is unstable, the limit is \d+ at 1 ms",
        ),
        (
            ["arm_controller.inverse_dynamics=false", "arm_controller.gains.joint_2.p=300"],
            r"CTRL156.*joint_2: p 300 sags 0.\d+ rad under its gravity load of \d+.*, more than its tolerance of 0.03",
        ),
    ],
)
def test_every_other_doubt_has_its_numbers(overrides: list[str], told: str) -> None:
    found = findings(*(f"controllers.{each}" for each in overrides))
    assert re.search(told, str(found[0]))
    assert {finding.severity for finding in found} == {"warning"}


def test_an_effort_limit_below_gravity_or_below_the_plan_is_told() -> None:
    sinks = findings("robot.limits.joint_2.effort=20")
    assert re.search(r"joint_2: gravity needs up to [23]\d\.?\d* N m, its effort limit is 20 N m", str(sinks[0]))
    weight = float(re.findall(r"up to ([0-9.]+) N m", str(sinks[0]))[0])
    (lags,) = findings(f"robot.limits.joint_2.effort={weight + 0.5}")
    assert "the planned motions need up to" in lags.message


def test_a_soft_limit_of_the_velocity_that_leaves_too_little_effort_is_told() -> None:
    """At v it lets k_velocity (v_max - v) through; the weight takes 27 N m at the start, and v_max is 1.5 rad/s."""
    (slow,) = findings("robot.limits.joint_2.k_velocity=10")
    told = re.search(r"joint_2: .* need ([0-9.]+) N m at ([0-9.]+) rad/s, .* leaves ([0-9.]+) N m", str(slow))
    assert slow.code == "CTRL169"
    assert told is not None
    needed, v, left = map(float, told.groups())
    assert left == pytest.approx(10.0 * (1.5 - v), rel=0.01)
    assert left < needed == pytest.approx(27.0, abs=0.5)
    assert findings("robot.limits.joint_2.k_velocity=1000") == ()


def test_a_grasp_with_more_force_than_the_jaw_has_is_told(tmp_path: Path) -> None:
    """The Panda's description limits a finger to 20 N, half of which goes to the finger that mimics it.

    So it does in the simulation: with a force of 500 N each finger presses the block with 10.00 N.
    """
    file = tmp_path / "task.yaml"
    file.write_text(
        f"task: t\nrobot: {ROOT}/robots/panda/robot.yaml\ncontrollers: {ROOT}/controllers/panda.yaml\n"
        "steps:\n  - wait: 0.1 s\n  - grasp: {until: posture, force: 9 N}\n  - release:\n"
    )
    assert findings(task=file) == ()
    force, limit = "steps.grasp_1.grasp.force=11 N", "controllers.hand_controller.max_effort=10 N"
    for overrides, told in (
        ([force], "11 N exceeds the 10 N of panda_finger_joint1"),
        ([limit], "9 N exceeds the 5 N"),
    ):
        (found,) = findings(*overrides, task=file)
        assert re.search(f"step 'grasp_1': force {told}", found.message)
        assert (str(found.place), found.severity) == (f"{file}:6:5", "warning")


@pytest.mark.slow
def test_loops_that_only_quarrel_together_are_told() -> None:
    """Damping near the bound of each joint: the arm as a whole is softer than any joint alone."""
    bounds = {}
    for joint in ("joint_5", "joint_7"):
        (finding,) = findings(f"controllers.arm_controller.gains.{joint}.d=90")
        bounds[joint] = float(re.findall(r"unstable, the limit is ([0-9.]+)", finding.message)[0])
    both = [f"controllers.arm_controller.gains.{joint}.d={0.74 * bound}" for joint, bound in bounds.items()]
    (finding,) = findings(*both)
    assert finding.code == "CTRL154"
    assert "joint_5" in finding.message
    assert "joint_7" in finding.message


def test_check_tells_it(tmp_path: Path) -> None:
    controllers = (
        (ROOT / "controllers" / "arm7_hand3.yaml")
        .read_text()
        .replace("joint_7: {p: 30, d: 0.4}", "joint_7: {p: 30, d: 5}")
    )
    (tmp_path / "controllers.yaml").write_text(controllers)
    text = HOME.read_text()
    text = text.replace("../robots", str(ROOT / "robots")).replace("../controllers/arm7_hand3.yaml", "controllers.yaml")
    task = tmp_path / "home.yaml"
    task.write_text(text)
    assert any("joint_7" in finding.message and "unstable" in finding.message for finding in check_files([task]))
