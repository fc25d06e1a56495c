"""Two controllers of the same joints, one after the other: the reference is that of the one that is active."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.logs.replay import open_playback
from manipcli.logs.snapshot import moment
from manipcli.pipeline import run_task

REACHER = Path(__file__).parents[2] / "examples/04_own_robot"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`first` is active until 0.1 s, `second` from then on; commands come true at once."""
    folder = tmp_path_factory.mktemp("log")
    law = "{type: joint_trajectory, command_interface: position, joints: [pan, shoulder, elbow]"
    (folder / "controllers.yaml").write_text(f"controllers:\n  first: {law}}}\n  second: {law}, active: false}}\n")
    task = folder / "task.yaml"
    task.write_text(
        f"task: switched\nrobot: {REACHER}/robot.yaml\ncontrollers: controllers.yaml\n"
        "simulation: {engine: kinematic}\n"
        "steps: [{wait: 0.1 s}, {switch_controllers: second}, {wait: 0.1 s}]\n"
    )
    run_task(task, log=folder / "switched.mcap", force=True)
    return folder / "switched.mcap"


@pytest.mark.parametrize("time", [0.05, 0.15])
def test_a_moment_tells_the_reference_of_the_active_controller(log: Path, time: float) -> None:
    for joint in moment(log, time).joints:
        assert joint.reference == joint.position
        assert joint.error == 0.0


def test_a_replay_has_a_reference_before_and_after(log: Path) -> None:
    shown = open_playback(log)
    assert np.isfinite(shown.reference).all()
    np.testing.assert_array_equal(shown.reference, shown.position)
