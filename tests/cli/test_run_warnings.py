"""What is left out of files is told by `run` as `check` tells it: on stderr, in the JSON, and in a suite."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from manipcli.cli.app import main

ROBOT = """poses: {zero: {all: [0]}, up: {all: [0.2]}}
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
def folder(pendulum: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = pendulum(ROBOT)
    (folder / "c.yaml").write_text(ROS)
    for name, to in (("good", "up"), ("far", "{hinge: 3}")):
        (folder / f"{name}.yaml").write_text(
            f"task: {name}\nrobot: robot.yaml\ncontrollers: c.yaml\nstart: zero\n"
            f"simulation: {{settle: 0}}\nsaturation: false\nsteps: [{{move: {{to: {to}}}}}]\n"
        )
    monkeypatch.chdir(folder)
    return folder


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


def test_gains_that_nothing_feels_are_not_doubted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The engine without physics makes references come true."""
    kinematic = ["--set", "simulation.engine=kinematic", "--format", "json"]
    assert main(["run", "good.yaml", *kinematic]) == 0
    assert [one["code"] for one in json.loads(capsys.readouterr().out)["errors"]] == ["CTRL214"]
    (folder / "good.yaml").write_text((folder / "good.yaml").read_text().replace("settle: 0", "engine: kinematic"))
    main(["check", "good.yaml", "--format", "json"])
    codes = [one["code"] for one in json.loads(capsys.readouterr().out)["findings"] if one["severity"] == "warning"]
    assert codes == ["CTRL214"]
