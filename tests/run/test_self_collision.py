"""A hand that closes on its own palm: stopped there, named in the verdict; with `self_collision: false` it passes."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.pipeline import run_task

ROOT = Path(__file__).parents[2]
FILES = f"robot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: {ROOT}/controllers/arm7_hand3.yaml\n"
FIST = "\n".join(f"      finger_{k}_{joint}: 1.3" for k in (1, 2, 3) for joint in ("proximal", "distal"))
EXPECT = "expect:\n  - no_collision: {pairs: [[robot/palm, robot], [robot/finger_1_distal_link, robot/palm]]}\n"


def task_file(folder: Path, engine: str, settings: str, more: str = "") -> Path:
    file = folder / "fist.yaml"
    simulation = f"simulation: {{engine: {engine}, settle: 0.05{settings}}}\n"
    file.write_text(f"task: fist\n{FILES}{simulation}steps:\n  - wait: 0.1\n{more}")
    return file


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_fingers_stop_at_the_palm_and_the_verdict_says_so(tmp_path: Path, engine: str) -> None:
    close = f"  - move:\n     to:\n{FIST}\n    timeout: 2 s\n    on_fail: continue\n"
    run = run_task(task_file(tmp_path, engine, "", close + EXPECT), log=tmp_path / "on.mcap", allow_outside=True)
    pairs = {(each.a, each.b) for each in run.verdict.self_contacts}
    assert {(f"finger_{k}_distal_link", "palm") for k in (1, 2, 3)} <= pairs
    (expectation,) = run.verdict.expectations
    assert expectation.outcome == "failed"
    off = task_file(tmp_path, engine, ", self_collision: false", close)
    assert run_task(off, log=tmp_path / "off.mcap", allow_outside=True).verdict.self_contacts == ()
