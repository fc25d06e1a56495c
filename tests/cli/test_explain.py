"""`manipcli explain`: a code, or a task."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from manipcli.cli.app import main

ROOT = Path(__file__).parents[2]
POUR = ROOT / "tasks" / "pour.yaml"


def test_a_task(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", str(POUR)]) == 0
    text = capsys.readouterr().out
    assert "  2. lift_1: Lift 'cup' straight up by 8 to 20 cm.\n" in text
    assert "  1. inside: At the end, 'ball' is inside 'tray'.\n" in text
    assert "default" not in text


@pytest.mark.parametrize("option", ["--values", "-v"])
def test_its_values(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", str(POUR), option, "--set", "scene.cup.mass=80 g"]) == 0
    text = capsys.readouterr().out
    assert f"tilt 125 deg (= $tilt, {POUR}:5:16)\n" in text
    assert "scene.cup.mass 80 g (--set scene.cup.mass=80 g)\n" in text
    assert "velocity_scaling 0.5 (default)\n" in text


def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", str(POUR), "--format", "json"]) == 0
    task = json.loads(capsys.readouterr().out)
    assert [step["id"] for step in task["steps"]][:2] == ["pick_1", "lift_1"]
    tilt = next(value for value in task["steps"][2]["values"] if value["path"] == "tilt")
    assert (tilt["value"], tilt["expression"], tilt["parameters"][0]["place"]) == ("125 deg", "$tilt", f"{POUR}:5:16")


def test_a_task_with_errors_shows_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "task.yaml"
    path.write_text("task: t\nrobot: r.yaml\ncontrollers: c.yaml\nsteps:\n  - lfit: {object: cup}\n")
    assert main(["explain", str(path)]) == 4
    assert "did you mean 'lift'?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("tasks/por.yaml",), "there is no such file"),
        (("TASK99",), "there is no code or file 'TASK99'"),
        (("TASK203", "--values"), "need a task"),
        ((str(ROOT / "robots" / "panda" / "robot.yaml"),), "not a robot file"),
        ((str(ROOT),), "folder"),
    ],
)
def test_what_is_neither(
    words: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    assert main(["explain", *words]) == 4
    assert message in capsys.readouterr().err


def test_a_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "task203"]) == 0
    assert capsys.readouterr().out.startswith("TASK203")
