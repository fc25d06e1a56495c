"""Refusals that tell why: stages of candidates, the body that is in the way, the base that is too far away."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Transform
from manipcli.plan.base_move import RINGS, base_move
from manipcli.plan.candidates import Dropped
from manipcli.plan.why_not import by_stage, change_for_most, explained, stage_of

Make = Callable[..., Any]


def dropped(cause: str, *parts: str, name: str = "") -> tuple[str, Dropped]:
    return "pick_1", Dropped(name, NotPlannable(cause, parts=frozenset(parts)))


@pytest.mark.parametrize(
    ("cause", "stage"),
    [
        ("approach: the tool cannot follow the line", "approach"),
        ("'robot/palm' comes within 4 mm of 'wall' (1.0 mm apart) at t = 0.30 s of 'lift'", "lift"),
        ("tilt back: joint 'a' needs 12 N m", "tilt back"),
        ("'cup' is not held: the hand holds nothing", "-"),
        ("no joint positions reach (1, 2, 3) m: the nearest pose is 3 mm off", "-"),
        ("'cup' tilts by 30.0 deg, beyond `upright: 10 deg` at its end", "-"),
    ],
)
def test_the_stage_is_the_motion_that_the_cause_names(cause: str, stage: str) -> None:
    assert stage_of(cause) == stage


def test_groups_count_every_candidate_once_and_the_commonest_is_first() -> None:
    refused = [dropped("reach: too far", name="a"), *(dropped(f"lift: {k} mm short", name=f"b{k}") for k in range(3))]
    groups = by_stage(refused)
    assert [(group.stage, group.count) for group in groups] == [("lift", 3), ("reach", 1)]
    assert sum(group.count for group in groups) == len(refused)
    assert groups[0].names == ("b0", "b1", "b2")
    assert groups[0].cause == "lift: 0 mm short"


def test_the_change_frees_most_candidates() -> None:
    wall = [dropped("reach: blocked", "wall", "robot/palm"), dropped("lift: blocked", "wall", "cup")]
    other = dropped("reach: blocked", "box")
    assert change_for_most([*wall, other]) == (
        "move 'wall', or the goal away from it: it is in the way of 2 of 3 candidates"
    )
    assert change_for_most([dropped("reach: too far"), dropped("reach: too far"), other]) == ""


def test_a_remedy_is_searched_once_and_only_for_the_reported_refusal() -> None:
    calls: list[int] = []

    def remedy() -> str:
        calls.append(1)
        return "do this"

    refusal = NotPlannable("too far", hint="move it", remedy=remedy)
    again = explained(refusal.but(cause="reach: too far"), [])
    assert again.hint == "move it; do this"
    assert again.remedy is None
    assert len(calls) == 1


def test_the_base_moves_no_further_than_needed(bench: Make) -> None:
    """Oracle: a goal that the arm reaches, moved away by a known distance, is reached again after that distance."""
    arm = bench()
    solver = arm.planner.solver
    here = arm.planner.tool_pose(arm.start)
    away = Transform.of(xyz=(1.0, 0.0, 0.0)) @ here
    offset = base_move(solver, away, arm.start.position)
    assert offset is not None
    moved = Transform.of(xyz=(-offset[0], -offset[1], 0.0)) @ away
    solved = solver.solve(moved, arm.start.position, np.random.default_rng(3))
    np.testing.assert_allclose(solver.forward(solved).p, moved.p, atol=1e-4)
    assert float(np.hypot(*offset)) <= 1.0 + 1e-9


def test_a_goal_that_is_too_high_is_reached_from_nowhere(bench: Make) -> None:
    arm = bench()
    high = Transform.of(xyz=(0.0, 0.0, 5.0)) @ arm.planner.tool_pose(arm.start)
    assert base_move(arm.planner.solver, high, arm.start.position) is None
    refusal = arm.refused("move", {"pose": {"xyz": high.p.tolist()}})
    assert "with the tool at (" in refusal.cause
    assert refusal.remedy is not None
    assert refusal.remedy() == f"no position of the base within {RINGS[-1]:g} m along the ground reaches it"


def test_a_pose_out_of_reach_names_the_nearest_pose(bench: Make) -> None:
    """Oracle: the named point is as far from the goal as the message tells."""
    arm = bench()
    refusal = arm.refused("move", {"point": [1.6, 0.3, 0.8]})
    off = float(refusal.cause.split("the nearest pose is ")[1].split(" mm")[0])
    point = refusal.cause.split("with the tool at (")[1].split(")")[0]
    nearest = np.array([float(value) for value in point.split(", ")])
    assert np.linalg.norm(nearest - (1.6, 0.3, 0.8)) == pytest.approx(off / 1000.0, abs=2e-3)


def test_a_goal_in_the_desk_names_the_pair_that_collides(bench: Make) -> None:
    refusal = bench().refused("move", {"point": [0.75, 0.2, 0.38]})
    assert "only where" in refusal.cause
    assert "desk" in refusal.parts
    assert any(part.startswith("robot/") for part in refusal.parts)
    assert all(part in refusal.cause for part in refusal.parts)
