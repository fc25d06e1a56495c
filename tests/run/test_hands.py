"""Hands of other kinds lift and place a block of 4 cm: one moving jaw, linkages of mimic joints and of closed loops."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from manipcli.pipeline import run_task
from manipcli.record.read.reading import open_recording
from tests.run.gantry import PLACE, mass, written


def box(size: str, at: str) -> str:
    return f'<collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision>'


def turning(name: str, parent: str, child: str, at: str, axis: str, mimic: float = 0.0) -> str:
    leader = f'<mimic joint="left" multiplier="{mimic}"/>' if mimic else ""
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{at}"/>'
        f'<axis xyz="{axis}"/><limit lower="-1.2" upper="1.2" effort="5" velocity="3"/>{leader}</joint>'
    )


def finger(side: str, sign: int, *, rocker: bool = False) -> str:
    """A knuckle that turns outwards, and a tip that stays parallel to the palm's z: by a mimic joint or a rocker."""
    beside = f'<link name="{side}_rocker">{mass(0.03, 1e-4)}</link>'
    beside += turning(f"{side}_swing", "palm", f"{side}_rocker", f"0 {0.035 * sign} 0.03", "1 0 0")
    return (
        f'<link name="{side}_knuckle">{mass(0.05, 1e-4)}{box("0.015 0.01 0.05", "0 0 0.025")}</link>'
        f'<link name="{side}_tip">{mass(0.03, 1e-4)}{box("0.02 0.008 0.05", "0 0 0.025")}</link>'
        + turning(side, "palm", f"{side}_knuckle", f"0 {0.02 * sign} 0.03", "1 0 0", 0.0 if sign > 0 else -1.0)
        + turning(f"{side}_tip", f"{side}_knuckle", f"{side}_tip", "0 0 0.055", "1 0 0", 0.0 if rocker else -sign)
        + (beside if rocker else "")
    )


JAW: dict[str, Any] = {
    "hand": f'<link name="palm">{mass(0.5, 2e-3)}{box("0.03 0.1 0.02", "0 0 0.01")}'
    f'{box("0.02 0.01 0.09", "0 -0.03 0.065")}</link>'
    f'<link name="jaw">{mass(0.1, 2e-4)}{box("0.02 0.01 0.09", "0 -0.005 0.045")}</link>'
    + turning("hinge", "palm", "jaw", "0 0.03 0.02", "-1 0 0"),
    "joint": "hinge", "opened": 1.0, "closed": -0.2, "tool": 0.085,
}  # fmt: skip
LINKAGE: dict[str, Any] = {
    "hand": f'<link name="palm">{mass(0.5, 2e-3)}{box("0.03 0.08 0.02", "0 0 0.01")}</link>'
    + finger("left", 1) + finger("right", -1),
    "joint": "left", "opened": -0.5, "closed": 0.3, "tool": 0.11,
}  # fmt: skip


LOOPED = LINKAGE | {
    "hand": f'<link name="palm">{mass(0.5, 2e-3)}{box("0.03 0.08 0.02", "0 0 0.01")}</link>'
    + finger("left", 1, rocker=True) + finger("right", -1, rocker=True),
}  # fmt: skip
LOOPS = """loops:
  - {between: [left_tip, left_rocker], at: [0, 0.015, 0], driven_by: left}
  - {between: [right_tip, right_rocker], at: [0, -0.015, 0], driven_by: right}
"""


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
@pytest.mark.parametrize("hand", [JAW, LINKAGE, LOOPED], ids=["jaw", "linkage", "loops"])
def test_it_picks_and_places_by_friction_as_planned(tmp_path: Path, engine: str, hand: dict[str, Any]) -> None:
    file = written(tmp_path, engine=engine, mass="100 g, friction: 0.8", more=PLACE, **hand)
    if hand is LOOPED:
        with (tmp_path / "robot.yaml").open("a") as robot:
            robot.write(LOOPS)
    run = run_task(file, log=tmp_path / "log.mcap")
    assert run.verdict.verdict == "passed", run.verdict.text
    assert run.verdict.holding == ()
    assert "holding" not in open_recording(tmp_path / "log.mcap").metadata["run"]
    # With one jaw the block is pushed against the other one, by 5 mm: the plan knows.
    assert not [event for event in open_recording(tmp_path / "log.mcap").events if event.kind == "replanned"]


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_a_weld_closes_the_hand_and_holds_what_friction_cannot(tmp_path: Path, engine: str) -> None:
    slippery = "300 g, friction: 0.02"
    file = written(tmp_path, engine=engine, mass=slippery, holding="{weld: {force: 30 N}}", more=PLACE, **LINKAGE)
    run = run_task(file, log=tmp_path / "log.mcap")
    assert run.verdict.verdict == "passed", run.verdict.text
    assert run.verdict.holding == ("'block' held by weld (30 N), no friction grasp",)
    by_friction = run_task(written(tmp_path, engine=engine, mass=slippery, **LINKAGE), log=tmp_path / "log2.mcap")
    assert [step.outcome for step in by_friction.verdict.steps] == ["done", "failed"]
