"""What is round turns between two fingers, unless it has a spinning friction; the user is told before."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.pipeline import run_task
from manipcli.preflight.findings import preflight_findings
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: turn
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  peg: {{cylinder: {{radius: 15 mm, height: 60 mm}}, mass: 60 g, rests_on: table, at: [0.5, 0]}}
  cube: {{box: {{size: [3 cm, 3 cm, 3 cm]}}, mass: 60 g, rests_on: table, at: [0.5, 0.2]}}
params: {{what: peg}}
steps:
  - pick: {{object: $what, approach: {{from: top}}}}
  - lift: {{object: $what}}
expect:
  - slip: {{object: peg, within: 3 mm, rotation: 3 deg}}
"""


@pytest.mark.slow
def test_a_cylinder_between_two_fingers_turns_as_it_was_told(tmp_path: Path) -> None:
    file = tmp_path / "turn.yaml"
    file.write_text(TASK)
    (found,) = preflight_findings(load_task(file))
    assert (found.code, found.severity, found.place and found.place.line) == ("TASK240", "warning", 10)
    assert "'peg' (cylinder) may rotate between the point contacts" in found.message
    spins = "scene.peg.spinning_friction=0.01"
    assert preflight_findings(load_task(file, overrides=[spins])) == ()
    assert preflight_findings(load_task(file, overrides=["params.what=cube"])) == ()
    verdicts = [run_task(file, overrides=more, log=tmp_path / "t.mcap", force=True).verdict for more in ([], [spins])]
    assert [verdict.expectations[0].outcome for verdict in verdicts] == ["failed", "passed"]
