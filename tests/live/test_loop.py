"""A trajectory on the arm's topic brings it home at its time; a session simulated from its log is the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.live.command import END, PUBLISH, Command
from manipcli.record.read.reading import read_recording
from tests.live.sessions import HOME, ROOT, simulated, trajectory

AWAY, BACK, END_TICK = 10, 610, 3700


@pytest.mark.parametrize("task", ["pour", "pour_iiwa"])
def test_a_trajectory_of_one_point_brings_the_arm_home_in_3_s(task: str, tmp_path: Path) -> None:
    path, log = ROOT / f"tasks/{task}.yaml", tmp_path / "session.mcap"
    robot = pipeline.load_task(path).robot
    arm = robot.group("arm").joints
    home = np.array(HOME)

    def to(positions: np.ndarray, seconds: float) -> Command:
        message = trajectory(arm, positions.tolist(), seconds)
        message["header"] = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
        for point in message["points"]:
            point.update(velocities=[], accelerations=[], effort=[])
        return Command(PUBLISH, "/arm_controller/joint_trajectory", json=json.dumps(message))

    simulated(path, {AWAY: [to(home + 0.1, 0.5)], BACK: [to(home, 3.0)], END_TICK: [Command(END, "")]}, log)

    recording = read_recording(log)
    (trace,) = [trace for trace in recording.controllers if trace.name == "arm_controller"]
    arrived = np.flatnonzero(np.abs(trace.reference_position[BACK:] - home).max(axis=1) < 1e-9)[0]
    assert abs(arrived - 3000) <= 20
    assert trace.joints == arm
    assert np.abs(trace.position[BACK + 3000 + 20] - home).max() < 0.03
    if task == "pour":
        assert pipeline.verify_log(log).identical
