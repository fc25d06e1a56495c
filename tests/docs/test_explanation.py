"""Numbers on the pages of docs/explanation/ are those of this version."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli import load_task, read_recording
from manipcli.core.geometry import Transform
from manipcli.model.kinematics import Kinematics

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs" / "explanation"
POUR = ROOT / "tasks" / "pour.yaml"
WEIGHT = 9.81 * 0.160
"""[N] of the cup with its ball."""


def row(page: str, first: str) -> list[str]:
    """The cells of the row of a table whose first cell begins with `first`, without it."""
    text = (PAGES / page).read_text(encoding="utf-8")
    (line,) = re.findall(rf"^\| {re.escape(first)}.*$", text, flags=re.MULTILINE)
    return [cell.strip() for cell in line.strip("|").split("|")][1:]


@pytest.mark.slow
def test_the_planned_margins_of_the_grasp_are_those_of_the_page(call_cli: Any) -> None:
    shown = dict(zip(row("contact.md", "friction |"), row("contact.md", "planned:"), strict=True))
    for friction in ("1.0", "0.2", "0.15"):
        words = ("--until", "lift_1", "--set", f"scene.cup.friction={friction}", "--quiet")
        told = call_cli("plan", POUR, *words, cwd=ROOT).out
        found = re.search(r"holds (\S+) x (the|its) weight", told)
        assert found is not None, told
        assert found[1] == shown[friction]


@pytest.mark.slow
def test_the_arm_sags_as_the_weight_of_the_cup_stretches_its_springs(pour_run: Any) -> None:
    task, recording = load_task(POUR), read_recording(pour_run.log)
    states, k = recording.states, 3000  # at 3.0 s
    kinematics = Kinematics(task.robot, gravity=task.scene.gravity)
    position, cup = states.position[k], states.body_position[k, recording.body_names.index("cup")]
    X_LC = Transform.of(xyz=kinematics.forward(position, "palm").inverse().apply(cup))
    efforts = kinematics.jacobian(position, "palm", X_LC)[:3].T @ (0.0, 0.0, WEIGHT)
    arm = next(trace for trace in recording.controllers if trace.name == "arm_controller")
    for joint in ("joint_2", "joint_4", "joint_6"):
        stiffness, error, pulled, loaded = (float(cell.split()[0]) for cell in row("control.md", f"{joint} |"))
        j = arm.joints.index(joint)
        measured = float(arm.reference_position[k, j] - arm.position[k, j])
        effort = float(efforts[recording.joint_names.index(joint)])
        # The page: 2 % for what differs from machine to machine. The law: 3 %, as the arm still moves.
        np.testing.assert_allclose([measured, effort], [error, loaded], rtol=0.02)
        assert stiffness * measured == pytest.approx(effort, rel=0.03)
        assert pulled == pytest.approx(stiffness * error, rel=0.01)
