"""Gains that keep a joint at its limit fail a run whose written expectations are all met."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from manipcli.logs.judge_log import judge_log
from manipcli.pipeline import run_task

pytestmark = pytest.mark.slow
EXAMPLE = Path(__file__).parents[2] / "examples" / "04_own_robot"
LOOSE = "    constraints: {goal_time: 0, stopped_velocity_tolerance: 0}\n"


@pytest.fixture
def task(tmp_path: Path) -> Path:
    shutil.copytree(EXAMPLE, tmp_path / "own")
    path = tmp_path / "own" / "controllers.yaml"
    path.write_text(path.read_text().replace("pan: {p: 60, d: 4}", "pan: {p: 20000, d: 60}") + LOOSE)
    task = tmp_path / "own" / "task.yaml"
    task.write_text(task.read_text().partition("expect:")[0] + "expect: [{duration: {below: 60 s}}]\n")
    return task


def test_it_fails_by_name_with_the_same_verdict_from_the_file(task: Path, tmp_path: Path) -> None:
    log = tmp_path / "x.mcap"
    verdict = run_task(task, log=log).verdict
    assert verdict.verdict == "failed"
    assert verdict.text.startswith("expectation 'saturation' failed: joint 'pan' is at its effort limit (40 N m) in")
    assert [each.outcome for each in verdict.expectations] == ["passed"]
    (saturation,) = verdict.implied
    assert saturation.margin is not None
    assert saturation.margin < 0.0
    assert judge_log(log) == verdict


@pytest.mark.parametrize("value", ["false", "100 %"])
def test_the_task_can_set_it_otherwise(task: Path, tmp_path: Path, value: str) -> None:
    verdict = run_task(task, log=tmp_path / "x.mcap", overrides=[f"saturation={value}"]).verdict
    assert verdict.verdict == "passed"
    assert len(verdict.implied) == (0 if value == "false" else 1)
