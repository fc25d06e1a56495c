"""The hint of a tool frame that is not the hand's: what a hand whose axes are right never gets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from manipcli.core.geometry import Transform
from manipcli.plan.planner import Planner
from manipcli.plan.tool_axes import misplaced

Make = Callable[..., Any]  # the fixture of conftest.py: a Bench of a robot and a scene
HANDS = [("panda", "closed"), ("arm7_hand3", "wrap")]
QUARTER = np.pi / 2


def turned(arm: Any, **change: Any) -> Planner:
    """The same with another tool frame: `rpy` turns it, `link` and `X_LT` replace what they name."""
    tool = replace(arm.robot.tool, **{key: value for key, value in change.items() if key != "rpy"})
    tool = replace(tool, X_LT=tool.X_LT @ Transform.of(rpy=change.get("rpy", (0.0, 0.0, 0.0))))
    old = arm.planner
    return Planner(
        replace(arm.robot, tool=tool), arm.scene, period=old.period, rng=np.random.default_rng(1),
        gripper_joints=old.gripper_joints, gripper_speed=old.gripper_speed,
    )  # fmt: skip


@pytest.mark.parametrize(("robot", "closed"), HANDS)
@pytest.mark.parametrize(
    ("rpy", "told"),
    [
        ((0, 0, 0), None),
        ((0, 0, 2 * QUARTER), None),  # the hand turned over: fingers still close along y
        ((0.3, 0.3, 0.3), None),
        ((2 * QUARTER, 0, 0), "seems to point back into the hand"),
        ((0, 2 * QUARTER, 0), "seems to point back into the hand"),
        ((0, QUARTER, 0), "seems to point sideways"),
        ((0, 0, QUARTER), "align the tool's y with the direction in which the fingers close"),
        ((0, 0, QUARTER / 2), "align the tool's y with the direction in which the fingers close"),
    ],
)
def test_a_turned_tool_is_told_by_the_axis_that_is_wrong(
    bench: Make, robot: str, closed: str, rpy: tuple[float, float, float], told: str | None
) -> None:
    arm = bench(robot)
    rng = np.random.default_rng(0)
    for _ in range(2):  # wherever the arm is
        q = np.array(arm.start.position) + rng.uniform(-0.3, 0.3, len(arm.start.position))
        hint = misplaced(turned(arm, rpy=rpy), arm.start.moved(q), "open", closed)
        assert (hint is None) == (told is None)
        assert (told or "") in (hint or "")


def test_a_tool_frame_at_the_flange_is_told(bench: Make) -> None:
    """Without `tool:` it is the tip of the first group: the flange of the Panda, 58 mm before its fingers begin."""
    arm = bench("panda")
    hint = misplaced(turned(arm, link="panda_link8"), arm.start, "open", "closed")
    assert hint is not None
    assert "seems to be 58 mm behind the fingers): `tool: {link: ..., pose: " in hint


@pytest.mark.slow
def test_a_pick_with_a_wrong_tool_says_so_and_one_with_a_right_tool_does_not(bench: Make) -> None:
    arm = bench("panda")
    spec = {"object": "block", "approach": {"from": "top"}}
    arm.planner = turned(arm, rpy=(2 * QUARTER, 0, 0))
    assert arm.refused("pick", spec).hint.startswith("point the tool's +z out of the hand")
    arm.planner = turned(arm)
    arm.do("pick", spec)
    arm = bench("panda")
    assert "tool's" not in arm.refused("pick", {**spec, "approach": {"from": "side"}}).hint
