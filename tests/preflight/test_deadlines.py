"""A step that cannot be over before its timeout is told before anything moves."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.preflight.findings import preflight_findings
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

ROOT = Path(__file__).parents[2]
TASK = """\
task: late
robot: {root}/examples/04_own_robot/robot.yaml
controllers: {root}/examples/04_own_robot/controllers.yaml
steps:
  - move: {{to: left}}
    timeout: {timeout}
  - wait: 2 s
    timeout: {wait}
"""


def _told(tmp_path: Path, timeout: float, wait: float) -> list[tuple[str, int | None]]:
    file = tmp_path / "late.yaml"
    file.write_text(TASK.format(root=ROOT, timeout=timeout, wait=wait))
    task = load_task(file)
    findings = [found for found in preflight_findings(task, plan_task(task)) if found.code == "TASK243"]
    assert all(found.severity == "warning" for found in findings)
    return [(found.message, found.place.line if found.place else None) for found in findings]


def test_a_timeout_shorter_than_the_plan_is_told(tmp_path: Path) -> None:
    ((message, line),) = _told(tmp_path, 0.1, 2.0)
    assert message.startswith("step 'move_1' times out after 0.1 s, its plan takes 0.")
    assert line == 6


@pytest.mark.parametrize(("wait", "told"), [(1.999, True), (2.0, False), (2.1, False)])
def test_it_is_told_from_the_planned_duration_on(tmp_path: Path, wait: float, told: bool) -> None:
    messages = [message for message, _ in _told(tmp_path, 100.0, wait)]
    assert messages == (["step 'wait_1' times out after 1.999 s, its plan takes 2 s"] if told else [])
