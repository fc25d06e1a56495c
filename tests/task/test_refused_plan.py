"""A step that cannot be planned is told where the user wrote it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from manipcli.cli.app import main
from manipcli.core.errors import NotPlannable
from manipcli.model.kinematics import Kinematics
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

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


@pytest.mark.parametrize("name", ["block", "wall"])  # before and after `robot/...` in the order of names
@pytest.mark.parametrize(
    "body",
    [
        "{box: {size: [6 cm, 6 cm, 6 cm]}, pose: {xyz: [X]}, fixed: true}",
        "{sphere: {radius: 3 cm}, mass: 1, pose: {xyz: [X]}}",
    ],
)
def test_a_robot_that_starts_inside_of_a_body_is_told_so_also_where_nothing_moves_it(
    body: str, name: str, tmp_path: Path
) -> None:
    file = tmp_path / "task.yaml"
    head = TASK[: TASK.index("steps:")]
    tip = load_task(_written(file, head + "steps:\n  - wait: 0.1 s\n")).robot
    x, y, z = Kinematics(tip).forward(np.zeros(len(tip.moving_joints)), tip.links[-1].name).p
    placed = body.replace("X", f"{x:.4f}, {y:.4f}, {z:.4f}")
    task = load_task(_written(file, f"{head}scene:\n  {name}: {placed}\nsteps:\n  - wait: 0.1 s\n  - wait: 0.1 s\n"))
    with pytest.raises(NotPlannable) as refused:
        plan_task(task)
    (finding,) = refused.value.findings
    assert finding.place is not None
    assert (finding.place.line, finding.place.column) == (8, 5)
    both = rf"('robot/\w+' and '{name}'|'{name}' and 'robot/\w+')"
    assert re.fullmatch(rf"step 'wait_1': {both} overlap by [\d.]+ mm at the start", finding.message)
    assert finding.hint is not None
    assert "`start: POSE`" in finding.hint


def _written(file: Path, text: str) -> Path:
    file.write_text(text)
    return file


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
