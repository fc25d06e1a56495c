"""What a task leaves out of its log, the judge does not guess."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from manipcli.cli.app import main
from manipcli.logs.replay import open_playback
from manipcli.pipeline import judge_log, run_task

ROOT = Path(__file__).parents[2]
TASK = (
    f"task: choice\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: {ROOT}/controllers/arm7_hand3.yaml\n"
    "scene:\n  cube: {box: {size: [0.05, 0.05, 0.05]}, mass: 0.1, pose: {xyz: [0.8, 0.5, 0.025]}}\n"
    "simulation: {settle: 0.1 s}\n"
    "steps: [{wait: 0.1 s}]\n"
    "expect:\n  - near: {object: cube, to: start, within: 1 cm}\n  - no_collision: {pairs: [[robot, cube]]}\n"
    "  - tracking: {group: arm, within: 0.2 rad}\n  - at_pose: {pose: home, within: 0.2 rad}\n"
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("record", "unknown"),
    [
        ("{rates: {tf: 100 Hz, controller_state: 200 Hz}}", {}),
        ("{topics: [controller_state, contacts]}", {"near": "/tf"}),
        ("{topics: [tf, controller_state]}", {"no_collision": "/contacts"}),
        ("{topics: [tf, contacts]}", {"tracking": "/arm_controller/controller_state"}),
    ],
)
def test_an_expectation_that_lacks_its_topic_says_so_and_fails(
    record: str, unknown: dict[str, str], tmp_path: Path
) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(f"{TASK}record: {record}\n")
    log = tmp_path / "log.mcap"
    verdict = run_task(path, log=log).verdict
    found = {e.name: e.text for e in verdict.expectations if e.outcome == "not_evaluated"}
    assert {e.name for e in verdict.expectations if e.outcome == "passed"} | found.keys() == {
        "near", "no_collision", "tracking", "at_pose"
    }  # fmt: skip
    assert found == {
        name: f"the log has no {topic}: the task's `record:` excludes it" for name, topic in unknown.items()
    }
    assert verdict.verdict == ("failed" if unknown else "passed")
    assert judge_log(log) == verdict


def test_a_log_without_bodies_is_shown_and_told_as_far_as_it_goes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(f"{TASK}record: {{topics: [controller_state]}}\n".replace("settle", "engine: kinematic, settle"))
    log = tmp_path / "log.mcap"
    run_task(path, log=log)
    playback = open_playback(log)
    np.testing.assert_allclose(playback.body_position[-1], [[0.8, 0.5, 0.025]])
    assert "/tf not recorded" in playback.notes[-1]
    assert main(["at", str(log), "0.05", "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["poses"], found["contacts"]) == ([], None)
    assert found["missing"] == ["/tf not recorded", "/contacts not recorded"]
    assert found["step"] == "wait_1"
