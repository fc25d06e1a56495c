"""`check` of a controllers file that no task names: it says what it could not look at."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.cli.app import main

ROOT = Path(__file__).parents[2]
CONTROLLERS = str(ROOT / "controllers" / "arm7_hand3.yaml")
SAID = "joints and gains of controllers were not compared with a robot: check a task that names both\n"


def test_controllers_alone_are_compared_with_no_robot_and_it_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", CONTROLLERS]) == 0
    said = capsys.readouterr()
    assert said.out == "✓ passed: 1 file checked, 0 errors\n"
    assert said.err == SAID


@pytest.mark.slow
def test_with_a_task_there_is_nothing_to_add(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(ROOT / "tasks" / "home.yaml"), CONTROLLERS]) == 0
    assert capsys.readouterr().err == ""


def test_nor_where_they_are_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "controllers.yaml"
    path.write_text("controllers:\n  arm: {type: joint_trajectry, joints: [a]}\n")
    assert main(["check", str(path)]) == 1
    assert capsys.readouterr().err == ""
