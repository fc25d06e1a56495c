"""`info`, `repair` and `at` as a person meets them, on a log of a run without physics."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from manipcli.cli.app import main
from manipcli.pipeline import run_task

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One move and one wait of the arm, on the ideal engine."""
    folder = tmp_path_factory.mktemp("run")
    task = folder / "task.yaml"
    task.write_text(
        f"task: wave\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: {ROOT}/controllers/arm7_hand3.yaml\n"
        "simulation: {engine: kinematic}\n"
        "scene:\n  cube: {box: {size: [0.05, 0.05, 0.05]}, mass: 0.1, pose: {xyz: [0.8, 0.5, 0.025]}}\n"
        "steps:\n  - move: {to: {joint_1: 0.3}}\n  - wait: 0.2 s\n"
        "expect: [{duration: {below: 20 s}}]\n"
    )
    path = folder / "wave.mcap"
    assert run_task(task, log=path).verdict.verdict == "passed"
    return path


def test_info_tells_verdict_steps_topics_and_sizes(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", str(log)]) == 0
    text = capsys.readouterr().out
    assert "✓ wave passed" in text
    assert "missing" not in text
    assert any(line.split()[:2] == ["/joint_states", "sensor_msgs/msg/JointState"] for line in text.splitlines())
    assert main(["info", str(log), "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["size"] == log.stat().st_size
    assert found["verdict"]["verdict"] == "passed"
    assert [step["outcome"] for step in found["steps"]] == ["done", "done"]
    (joints,) = [topic for topic in found["topics"] if topic["name"] == "/joint_states"]
    assert joints["rate"] == pytest.approx(1000.0)
    assert joints["messages"] == round(1000 * found["duration"]) + 1
    assert found["size_per_minute"] == pytest.approx(60 * found["size"] / found["duration"])


def test_a_cut_log_is_told_repaired_and_never_passes(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = log.read_bytes()
    cut = tmp_path / "run.mcap.partial"
    cut.write_bytes(data[: len(data) * 3 // 4])
    assert main(["info", str(cut)]) == 0
    assert "missing: it was not finished" in capsys.readouterr().out
    assert main(["repair", str(cut)]) == 0
    assert "lost after t = " in capsys.readouterr().out
    clean = tmp_path / "run.repaired.mcap"
    assert main(["judge", str(clean)]) == 3
    assert "it was repaired" in capsys.readouterr().out
    assert main(["repair", str(cut)]) == 4, "what exists stays"
    assert "the file exists" in capsys.readouterr().err
    assert main(["repair", str(log), "-o", str(clean), "--force", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["losses"] == []
    assert main(["judge", str(clean)]) == 0


@pytest.mark.parametrize("command", ["info", "repair", "judge"])
def test_what_is_no_log_is_refused(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    (tmp_path / "text").write_text("hello")
    for name, why in (("pipe", "not a regular file"), ("text", "no MCAP file"), ("absent", "No such file")):
        assert main([command, str(tmp_path / name)]) == 4
        assert why in capsys.readouterr().err
