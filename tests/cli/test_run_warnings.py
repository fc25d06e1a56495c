"""What is left out of files is told by `run` as `check` tells it: on stderr, in the JSON, and in a suite."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from manipcli.cli.app import main

URDF = """<robot name="pendulum"><link name="base"/>
<link name="arm"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>
<inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="3" effort="20"/></joint></robot>"""
ROBOT = """robot: pendulum
description: pendulum.urdf
groups: {all: {joints: [hinge]}}
poses: {zero: {all: [0]}, up: {all: [0.2]}}
tool: {link: arm}
limits: {hinge: {acceleration: 10}}
"""
ROS = """controller_manager:
  ros__parameters:
    update_rate: 1000
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
    io: {type: ur_controllers/GPIOController}
arm:
  ros__parameters:
    joints: [hinge]
    command_interfaces: [effort]
    state_interfaces: [position, velocity]
    gains: {hinge: {p: 12.0, d: 400.0}}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "pendulum.urdf").write_text(URDF)
    (tmp_path / "robot.yaml").write_text(ROBOT)
    (tmp_path / "c.yaml").write_text(ROS)
    for name, to in (("good", "up"), ("far", "{hinge: 3}")):
        (tmp_path / f"{name}.yaml").write_text(
            f"task: {name}\nrobot: robot.yaml\ncontrollers: c.yaml\nstart: zero\n"
            f"simulation: {{engine: kinematic}}\nsteps: [{{move: {{to: {to}}}}}]\n"
        )
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(("task", "codes"), [("good.yaml", ["CTRL214", "CTRL150"]), ("far.yaml", ["CTRL214"])])
def test_run_tells_what_check_tells(
    folder: Path, capsys: pytest.CaptureFixture[str], task: str, codes: list[str]
) -> None:
    main(["run", task, "--format", "json"])
    told = capsys.readouterr()
    findings = json.loads(told.out)["errors"]
    warned = [one for one in findings if one["severity"] == "warning"]
    assert [one["code"] for one in warned] == codes
    assert findings[len(findings) - len(warned) :] == warned, "after what ended it"
    main(["check", task, "--format", "json"])
    checked = [one for one in json.loads(capsys.readouterr().out)["findings"] if one["severity"] == "warning"]
    assert checked[: len(warned)] == warned  # where nothing is planned, `check` looks at gains in the named poses
    assert [f"warning[{code}]" in told.err for code in codes] == [True] * len(codes)
    assert told.err.count("warning[") == len(codes)


def test_only_the_result_where_nothing_else_is_wanted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "good.yaml", "--quiet"]) == 0
    told = capsys.readouterr()
    assert (told.err, "CTRL" in told.out) == ("", False)
    main(["run", "good.yaml", "--quiet", "--format", "json"])
    assert [one["code"] for one in json.loads(capsys.readouterr().out)["errors"]] == ["CTRL214", "CTRL150"]


@pytest.mark.slow
def test_a_suite_has_them_too(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["test", "good.yaml", "--format", "json"])
    (case,) = json.loads(capsys.readouterr().out)["cases"]
    assert [one["code"] for one in case["warnings"]] == ["CTRL214", "CTRL150"]
    assert [one["code"] for one in case["run"]["errors"]] == ["CTRL214", "CTRL150"]
