"""A constraint about a held object where nothing is held is told before anything moves."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.preflight.findings import preflight_findings
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

ROOT = Path(__file__).parents[2]
TASK = """\
task: t
robot: {root}/robots/panda/robot.yaml
controllers: {root}/controllers/panda.yaml
scene:
  table: {{box: {{size: [0.5, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  block: {{box: {{size: [4 cm, 4 cm, 6 cm]}}, mass: 100 g, rests_on: table, at: [0.5, -0.15]}}
steps:
  - move: {{to: home}}
    keep: {first}
  - pick: {{object: block, approach: {{from: top}}}}
  - lift: {{object: block, by: 10 cm}}
    keep: {second}
"""
EMPTY = "step 'move_1': `keep: {}` has no effect: the hand holds nothing in its motions"


@pytest.mark.parametrize(
    ("first", "second", "messages"),
    [
        ("{upright: 10 deg, tool_speed: 2}", "{upright: 10 deg}", [(9, EMPTY.format("upright"))]),
        (
            "[{slosh: 10 deg}, {upright: 10 deg}]",
            "{tool_speed: 2}",
            [(9, EMPTY.format(w)) for w in ("slosh", "upright")],
        ),
        (
            "{tool_speed: 2}",
            "{slosh: 20 deg}",
            [(12, "step 'lift_1': `keep: slosh` without contents: 'block' is empty in the plan")],
        ),
    ],
)
def test_it_is_reported_with_its_place(
    tmp_path: Path, first: str, second: str, messages: list[tuple[int, str]]
) -> None:
    file = tmp_path / "t.yaml"
    file.write_text(TASK.format(root=ROOT, first=first, second=second))
    task = load_task(file)
    found = [each for each in preflight_findings(task, plan_task(task)) if each.code == "TASK249"]
    assert [(each.place.line if each.place else None, each.message) for each in found] == messages
    assert all(each.severity == "warning" for each in found)
