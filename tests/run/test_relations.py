"""Places relative to things and parts of bodies, from the file to the verdict in physics."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.pipeline import run_task

ROOT = Path(__file__).parents[2]

TASK = f"""
task: relations
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
simulation: {{settle: 100 ms}}
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  red:
    box: {{size: [6 cm, 4 cm, 4 cm]}}
    mass: 80 g
    rests_on: table
    frame: table/top
    at: [-0.05, -0.1]
    yaw: 30 deg
  green:
    box: {{size: [4 cm, 4 cm, 6 cm]}}
    mass: 80 g
    rests_on: table
    at: [0.6, 0.05]
    parts: {{head: {{pose: {{xyz: [0, 0, 15 mm]}}, size: [4 cm, 4 cm, 2 cm]}}}}
steps:
  - pick: {{object: green, part: head, approach: {{from: top}}}}
  - lift: {{object: green}}
  - place: {{object: green, at: {{of: red, side: left, gap: 5 cm}}, yaw: 0}}
  - pick: {{object: green, approach: {{from: top}}}}
  - lift: {{object: green}}
  - place: {{object: green, onto: red, yaw: 0}}
    until: {{rests_on: {{object: green, of: red}}}}
expect:
  - near: {{object: green, to: [0, 9 cm, 1 cm], frame: red, within: 3 mm}}
    at: place_1
  - near: {{object: green/bottom, to: red/top, within: 3 mm}}
  - rests_on: {{object: green, of: red}}
"""


@pytest.mark.slow
def test_a_block_is_set_beside_another_and_then_on_its_middle(tmp_path: Path) -> None:
    file = tmp_path / "relations.yaml"
    file.write_text(TASK)
    report = run_task(file, log=tmp_path / "relations.mcap", allow_outside=True)
    assert report.verdict.verdict == "passed", report.verdict
