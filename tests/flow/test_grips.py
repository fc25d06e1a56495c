"""What is asked of hands, and what they can do."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import Finding
from manipcli.flow.gains import gain_findings
from manipcli.flow.load import Task, load_task
from manipcli.flow.plan import plan_task

ROOT = Path(__file__).parents[2]
SPEED = "controllers.hand_controller.speed"


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A Panda, whose fingers may do 0.2 m/s, opens its hand by 4 cm."""
    file = tmp_path / "task.yaml"
    file.write_text(
        f"task: t\nrobot: {ROOT}/robots/panda/robot.yaml\ncontrollers: {ROOT}/controllers/panda.yaml\n"
        "steps:\n  - grasp: {until: posture, force: 9 N}\n"
    )
    return file


def findings(task: Task) -> tuple[Finding, ...]:
    return gain_findings(task)


@pytest.mark.parametrize(("speed", "duration"), [("0.05", 0.8), ("null", 0.2), ("0.4", 0.1)])
def test_a_hand_is_as_fast_as_it_is_told_and_by_itself_as_its_joints_may(
    small: Path, speed: str, duration: float
) -> None:
    plan = plan_task(load_task(small, overrides=[f"{SPEED}={speed}"]))
    assert plan.steps[0].plan.duration == pytest.approx(duration)


def test_a_hand_that_is_told_to_be_faster_than_a_joint_may_be_is_doubted(small: Path) -> None:
    for speed in ("0.2", "null"):
        assert findings(load_task(small, overrides=[f"{SPEED}={speed}"])) == ()
    (found,) = findings(load_task(small, overrides=[f"{SPEED}=0.25"]))
    assert (found.code, found.severity) == ("CTRL167", "warning")
    assert found.message == ("panda_finger_joint1: its references move at 0.25 m/s, its velocity limit is 0.2 m/s")
