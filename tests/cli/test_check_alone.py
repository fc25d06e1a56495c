"""`check` of several files at once, and of a controllers file that no task names: it says what it could not look at."""

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
    assert capsys.readouterr().err == "planning step 1 of 1, 'follow_1'\n"


def test_nor_where_they_are_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "controllers.yaml"
    path.write_text("controllers:\n  arm: {type: joint_trajectry, joints: [a]}\n")
    assert main(["check", str(path)]) == 1
    assert capsys.readouterr().err == ""


def test_what_two_files_share_is_told_and_counted_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "one.yaml").write_text("robot: one\ndescription: one.urdf\nspeed: 3\n")
    task = f"task: wait\nrobot: robots/one.yaml\ncontrollers: {CONTROLLERS}\nsteps: [{{wait: 1}}]\n"
    (tmp_path / "a.yaml").write_text(task)
    (tmp_path / "b.yaml").write_text(task)
    assert main(["check", "a.yaml", "b.yaml", "robots/one.yaml"]) == 1
    said = capsys.readouterr().out
    assert said.count("robots/one.yaml:3:1: error[ROBOT201]: unknown key 'speed'") == 1
    assert said.count("error[ROBOT301]") == 1
    assert said.endswith("3 files checked, 2 errors\n")
