"""What had no more effort to give is counted, in the log, and told where a step failed for it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from manipcli.core.errors import Diagnostic
from manipcli.logs.judge_log import judge_log
from manipcli.logs.log_info import log_info
from manipcli.pipeline import run_task
from manipcli.record.read.reading import open_recording
from manipcli.report.logs.log_info import render_text

ROOT = Path(__file__).parents[2]
HOME = ROOT / "tasks" / "home.yaml"


class Listener:
    """Keeps what is told before the first step."""

    def __init__(self) -> None:
        self.doubts: list[Diagnostic] = []

    def activity(self, what: str) -> None: ...

    def warned(self, findings: Sequence[Diagnostic]) -> None:
        self.doubts += findings

    def step_started(self, *_: Any) -> None: ...
    def step_ended(self, *_: Any) -> None: ...
    def message(self, *_: Any, **__: Any) -> None: ...
    def tick(self, *_: Any) -> None: ...


def test_a_joint_too_weak_for_gravity_is_doubted_counted_and_named(tmp_path: Path) -> None:
    listener, log = Listener(), tmp_path / "home.mcap"
    report = run_task(
        HOME,
        log=log,
        overrides=["robot.limits.joint_2.effort=20", "controllers.arm_controller.constraints.joints.joint_2={}"],
        progress=listener,
    )
    (doubt,) = listener.doubts
    assert "joint_2: gravity needs up to" in doubt.message
    assert report.verdict.verdict == "failed"
    assert report.verdict.saturations == judge_log(log).saturations
    assert report.verdict.saturations.joints["joint_2"] > 0
    assert "joint 'joint_2' (effort) in" in render_text(log_info(log))
    counts = {k: int(v) for k, v in open_recording(log).metadata["saturated joints"].items()}
    cut = r"; saturated: joint 'joint_2' \(effort\) in (\d+) of (\d+) ticks"
    told = re.search(cut, report.verdict.steps[0].text)
    assert told is not None
    assert 0 < int(told[1]) <= min(int(told[2]), counts["joint_2"])


@pytest.mark.slow
def test_a_run_in_which_nothing_is_cut_says_nothing(tmp_path: Path) -> None:
    listener, log = Listener(), tmp_path / "home.mcap"
    assert run_task(HOME, log=log, progress=listener).verdict.verdict == "passed"
    assert listener.doubts == []
    assert "saturated joints" not in open_recording(log).metadata


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["pybullet", "kinematic"])
def test_the_hand_that_presses_on_its_stop_is_not_told(tmp_path: Path, engine: str) -> None:
    """The open hand of a Panda presses on its stop all the time."""
    task, log = tmp_path / "stop.yaml", tmp_path / "stop.mcap"
    task.write_text(
        f"task: stop\nrobot: {ROOT}/robots/panda/robot.yaml\ncontrollers: {ROOT}/controllers/panda.yaml\n"
        f"simulation: {{engine: {engine}, settle: 0}}\nstart: home\n"
        "steps: [{wait: 0.05 s, until: {duration: {below: 1 ms}}, timeout: 0.1 s}]\n"
    )
    verdict = run_task(task, log=log).verdict
    assert verdict.steps[0].outcome == "timeout"
    assert str(verdict.saturations) == "" == str(judge_log(log).saturations)
    assert "saturated" not in verdict.steps[0].text
