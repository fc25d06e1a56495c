"""Where the tool is at a moment of a log, by the lengths of the robot's links."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.logs.snapshot import moment
from manipcli.pipeline import run_task

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: reach
robot: {ROOT}/examples/04_own_robot/robot.yaml
controllers: {ROOT}/examples/04_own_robot/controllers.yaml
simulation: {{engine: kinematic}}
start: left
steps:
  - move: {{to: right}}
"""


def test_the_tool_is_where_the_joints_have_it(tmp_path: Path) -> None:
    file, log = tmp_path / "reach.yaml", tmp_path / "reach.mcap"
    file.write_text(TASK)
    end = run_task(file, log=log).verdict.simulated_time
    seen = [moment(log, time).tool for time in (0.0, 0.4, end)]
    for tool, pan in zip(seen, (1.2, None, -1.2), strict=True):
        assert tool is not None and tool.parent == "world" and tool.speed is not None
        if pan is None:
            assert tool.speed > 0.1
            continue
        out = 0.3 * np.sin(0.8)  # the elbow, which is the tip's frame: 0.3 m from the shoulder, 0.2 m up
        expected = [out * np.cos(pan), out * np.sin(pan), 0.2 + 0.3 * np.cos(0.8)]
        np.testing.assert_allclose(tool.pose.p, expected, atol=1e-6)
        assert tool.pose.R[2, 2] == pytest.approx(np.cos(0.8 + 0.6), abs=1e-6)
        assert tool.speed == pytest.approx(0.0, abs=1e-6)
