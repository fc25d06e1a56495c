"""A pick or a grasp that took its object and then failed is tried again with an open hand, or a firmer one."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli import pipeline
from manipcli.record.read.reading import read_recording

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: again
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
params: {{force: 4 N}}
simulation: {{engine: kinematic, settle: 0, step: 10 ms, control_period: 10 ms}}
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  block: {{box: {{size: [4 cm, 4 cm, 5 cm]}}, mass: 80 g, rests_on: table, at: [0.5, 0]}}
steps:
"""
NEVER = """\
    until: {at_pose: {pose: open, group: hand, slide: 1 mm}}
    timeout: 4 s
    on_fail: {retry: 1, with: {force: 9 N}, then: continue}
"""
REACH = "  - move: {pose: {xyz: [0.5, 0, 0.225], rpy: [180 deg, 0, 0]}}\n"


@pytest.mark.parametrize(
    ("steps", "phases"),
    [
        ("  - pick: {object: block, grasp: {force: $force}}\n", ["open", "withdraw", "reach", "approach", "close"]),
        (f"{REACH}  - grasp: {{object: block, force: $force}}\n", ["close"]),
    ],
)
def test_what_was_taken_in_vain_is_taken_again(tmp_path: Path, steps: str, phases: list[str]) -> None:
    file, log = tmp_path / "again.yaml", tmp_path / "again.mcap"
    file.write_text(f"{TASK}{steps}{NEVER}")
    last = pipeline.run_task(file, log=log).verdict.steps[-1]
    assert [(one.outcome, one.text.startswith("`until` did not hold by")) for one in last.attempts] == [
        ("timeout", True),
        ("timeout", True),
    ]
    events = [event for event in read_recording(log).events if event.step == last.id]
    again = max(k for k, event in enumerate(events) if event.kind == "step_started")
    assert [event.text for event in events[again:] if event.kind == "phase_started"] == phases
