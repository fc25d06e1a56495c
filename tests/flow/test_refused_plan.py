"""A step that cannot be planned is told where the user wrote it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from manipcli.cli.app import main

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: far
robot: {ROOT}/robots/differential_wrist/robot.yaml
controllers: {ROOT}/controllers/differential_wrist.yaml
simulation: {{engine: kinematic}}
steps:
  - wait: 0.1 s
  - id: reach
    move: {{to: {{pitch: 100}}}}
"""


@pytest.mark.slow
@pytest.mark.parametrize("command", ["run", "plan"])
def test_a_step_that_cannot_be_planned_is_told_at_its_line(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("task.yaml").write_text(TASK)
    assert main([command, "task.yaml"]) == 1
    told = capsys.readouterr()
    assert "task.yaml:8:24: error[PLAN100]: step 'reach': " in told.out + told.err
    assert main([command, "task.yaml", "--format", "json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert (answer["task"], answer["seed"], answer["engine"]) == ("far", 0, "kinematic")
    assert answer["real_time_factor"] is None
    assert [step["planned_duration"] for step in answer["steps"]] == [None, None]
    (error,) = answer["errors"]
    assert (error["file"], error["line"], error["column"]) == ("task.yaml", 8, 24)
