"""Constraints on the motions of a step; the oracle is the forward kinematics of the description (`Bench.tool`)."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.plan import constrained_motion, free_motion, kept_path, kept_problem
from manipcli.plan.candidates import first
from manipcli.plan.carrying import carry
from manipcli.plan.keep import Kept, reserving
from manipcli.plan.motion import Motion, PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.motion_margins import motion_margins
from manipcli.plan.path_kind import path_kind
from manipcli.plan.path_planners.rrt_connect import RrtConnectSpec
from manipcli.plan.steps import STEPS
from manipcli.spec.keep import KeepSpec

Bench = Any  # of conftest.py: a robot at a scene, on which steps are planned one after the other

PICK = {"object": "cup", "grasp": {"posture": "wrap", "height": "68 mm"}}
ACROSS = {"pose": {"xyz": [0.1, -0.2, 0.0]}, "frame": "tool"}


@pytest.fixture(scope="module")
def held(bench: Callable[..., Bench]) -> Bench:
    """The cup picked and lifted."""
    told = bench()
    told.do("pick", PICK)
    told.do("lift", {"object": "cup"})
    return told


def planned(bench: Bench, spec: object, *keep: object, verb: str = "move") -> StepPlan:
    step = STEPS[verb]
    planner = bench.planner.keeping(tuple(KeepSpec.model_validate(each) for each in keep))
    return first(step.ways(step.spec.model_validate(spec), planner, bench.now))


def tools(bench: Bench, plan: StepPlan, *, every: int = 1) -> tuple[Array, Motion]:
    """X_WT (k, 4, 4) at every n-th control tick of a plan with one motion."""
    (motion,) = plan.motions
    assert motion.trajectory is not None
    q = np.array(bench.now.position)
    columns = bench.robot.indices(motion.trajectory.names)
    found = []
    for row in motion.trajectory.positions[::every]:
        q[columns] = row
        found.append(bench.tool(q))
    return np.array(found), motion


def cups(bench: Bench, plan: StepPlan, *, every: int = 10) -> Array:
    """X_WO (k, 4, 4) of the cup."""
    X_TO = np.linalg.inv(bench.tool(bench.now.position)) @ bench.body("cup").matrix
    return np.asarray(tools(bench, plan, every=every)[0] @ X_TO)


def tilt(X_WO: Array) -> float:
    """The largest [deg]."""
    return float(np.degrees(np.arccos(np.clip(X_WO[:, 2, 2], -1.0, 1.0)).max()))


def test_a_cup_stays_upright_on_the_tools_line(held: Bench) -> None:
    free = planned(held, ACROSS, {"upright": 1.0})
    level = planned(held, ACROSS, {"upright": "1 deg"})
    assert tilt(cups(held, free)) > 1.5
    assert tilt(cups(held, level)) <= 1.0 + 1e-6
    np.testing.assert_allclose(cups(held, level)[-1, :3, 3], cups(held, free)[-1, :3, 3], atol=0.005)


def test_a_path_is_searched_where_the_line_is_no_help(held: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_path, "_tool_line", lambda *_: None)
    level = planned(held, ACROSS, {"upright": "2 deg"})
    again = planned(held, ACROSS, {"upright": "2 deg"})
    assert tilt(cups(held, level)) <= 2.0 + 1e-6
    (one,), (other,) = level.motions, again.motions
    assert one.trajectory is not None and other.trajectory is not None
    assert one.trajectory.velocities is not None
    np.testing.assert_array_equal(one.trajectory.velocities[-1], 0.0)


@pytest.mark.parametrize("limit", [0.5, 1.5])
def test_a_chosen_path_leaves_a_reserve_to_the_run(held: Bench, monkeypatch: pytest.MonkeyPatch, limit: float) -> None:
    """1 deg, at most a fifth of the limit."""
    monkeypatch.setattr(kept_path, "_tool_line", lambda *_: None)
    assert tilt(cups(held, planned(held, ACROSS, {"upright": 1.0}))) > limit
    assert tilt(cups(held, planned(held, ACROSS, {"upright": f"{limit} deg"}))) <= limit - min(1.0, 0.2 * limit) + 1e-6


@pytest.mark.parametrize(("at_end", "left"), [(1.0, 0.1), (0.1, 0.05), (0.0, 0.0), (-0.2, 0.0)])
def test_the_reserve_is_at_most_half_of_what_the_ends_leave(at_end: float, left: float) -> None:
    kept = Kept("upright", margin=lambda q: q[:, 0], reserve=0.1)
    (tighter,) = reserving((kept,), np.array([2.0]), np.array([at_end]))
    assert tighter.margin is not None
    assert 3.0 - tighter.margin(np.array([[3.0]]))[0] == pytest.approx(left)


def test_the_settings_of_the_planner_are_those_of_paths_that_keep_something(
    held: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without samples no path is searched, with few none is found, and the path that is found says by whom."""
    monkeypatch.setattr(kept_path, "_tool_line", lambda *_: None)
    (motion,) = planned(held, ACROSS, {"upright": "1 deg"}).motions
    assert motion.searched == "rrt_connect"
    monkeypatch.setattr(held.planner, "_paths", RrtConnectSpec(samples=0))
    none = refusal(held, ACROSS, {"upright": "1 deg"})
    assert re.fullmatch(r"'cup' tilts by 1\.\d deg, beyond `upright: 1 deg` on the straight path", none.cause)
    assert none.hint == "make the constraint wider, or `move` to a pose in between"
    monkeypatch.setattr(held.planner, "_paths", RrtConnectSpec(samples=1))
    few = refusal(held, ACROSS, {"upright": "1 deg"})
    assert "no path around obstacles keeps `upright`: " in few.cause
    assert few.hint is not None and few.hint.startswith("make the constraint wider, or ")


def test_without_samples_a_straight_path_needs_no_reserve(held: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_path, "_tool_line", lambda *_: None)
    monkeypatch.setattr(held.planner, "_paths", RrtConnectSpec(samples=0))
    free = tilt(cups(held, planned(held, ACROSS, {"upright": 1.0})))
    limit = free + 0.1  # of which 1 deg, at most a fifth, would be left to the run
    assert tilt(cups(held, planned(held, ACROSS, {"upright": f"{limit} deg"}))) == pytest.approx(free)


def test_where_only_a_path_without_the_reserve_exists_it_is_accepted(
    held: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def tighter(keeps: tuple[Kept, ...], *ends: Array) -> tuple[Kept, ...]:
        def margin(q: Array) -> Array:
            return np.array([0.1 if min(np.abs(x - end).max() for end in ends) < 1e-9 else -1.0 for x in q])

        return (replace(keeps[0], margin=margin),)

    with_reserve = planned(held, ACROSS, {"upright": "5 deg"})
    for module in (constrained_motion, free_motion):
        monkeypatch.setattr(module, "reserving", tighter)
    without = planned(held, ACROSS, {"upright": "5 deg"})
    assert tilt(cups(held, with_reserve)) <= 5.0 and tilt(cups(held, without)) <= 5.0


def test_the_kind_of_each_path_is_known(held: Bench) -> None:
    for path, kind in (("free", "straight"), ("linear", "tool line")):
        (motion,) = planned(held, {**ACROSS, "path": path}).motions
        assert path_kind(held.planner, motion, held.now) == kind
    (motion,) = planned(held, ACROSS, {"upright": "1 deg"}).motions
    assert path_kind(held.planner, motion, held.now) in ("tool line", "curve")
    assert path_kind(held.planner, replace(motion, searched="rrt_connect"), held.now) == "searched, rrt_connect"
    assert path_kind(held.planner, replace(motion, trajectory=None), held.now) == ""


@pytest.mark.parametrize(
    ("keep", "bound"),
    [
        ({"tool_speed": 0.1}, ("tool", "tool_speed")),
        ({"tool_acceleration": 0.2}, ("tool", "tool_acceleration")),
        ({"slosh": "1 deg"}, ("contents", "slosh")),
    ],
)
def test_what_binds_is_named(held: Bench, keep: dict[str, object], bound: tuple[str, str]) -> None:
    planner = held.planner.keeping((KeepSpec.model_validate(keep),))
    plan = planned(held, ACROSS, keep)
    found = motion_margins(planner, plan.motions[0], held.now)
    assert found.binding is not None
    assert (found.binding.joint, found.binding.quantity) == bound
    (margin,) = (margin for margin in found.margins if margin.quantity == bound[1])
    assert 0.9 < margin.used < 1.006


def test_a_motion_that_a_constraint_makes_endless_names_it(held: Bench) -> None:
    with pytest.raises(NotPlannable) as refused:
        planned(held, ACROSS, {"tool_speed": 1e-4})
    assert refused.value.cause.endswith("the motion takes more than 600 s because of `keep: tool_speed`")


def test_what_a_constraint_allows_anyway_changes_nothing(held: Bench) -> None:
    keep = {"upright": 1.5, "tool_speed": 50.0, "tool_acceleration": 500.0, "slosh": 1.4, "above": "desk"}
    one, other = (tools(held, plan)[1].trajectory for plan in (planned(held, ACROSS), planned(held, ACROSS, keep)))
    assert one is not None and other is not None
    np.testing.assert_array_equal(one.positions, other.positions)


@pytest.mark.parametrize("limit", [0.1, 0.3])
def test_the_tool_keeps_its_speed(held: Bench, limit: float) -> None:
    X_WT, _ = tools(held, planned(held, ACROSS, {"tool_speed": limit}))
    speed = np.linalg.norm(np.diff(X_WT[:, :3, 3], axis=0), axis=1) / 1e-3
    assert 0.98 * limit < speed.max() <= 1.005 * limit


def test_the_tool_keeps_its_acceleration(held: Bench) -> None:
    X_WT, _ = tools(held, planned(held, ACROSS, {"tool_acceleration": 0.5}))
    acceleration = np.linalg.norm(np.diff(X_WT[:, :3, 3], 2, axis=0), axis=1) / 1e-6
    assert 0.9 * 0.5 < acceleration.max() <= 1.005 * 0.5


def test_nothing_sloshes(held: Bench) -> None:
    """Second differences of the ball's position, in the cup's frame."""
    plan = planned(held, ACROSS, {"slosh": "5 deg"})
    X_WO = cups(held, plan, every=1)
    ball = np.linalg.inv(held.body("cup").matrix) @ held.body("ball").matrix
    p = (X_WO @ ball)[:, :3, 3]
    up = np.diff(p, 2, axis=0) / 1e-6 - held.scene.gravity
    f = np.einsum("kij,ki->kj", X_WO[1:-1, :3, :3], up)
    angle = np.degrees(np.arctan2(np.hypot(f[:, 0], f[:, 1]), f[:, 2]))
    assert angle.max() <= 5.0 * 1.01
    faster = planned(held, ACROSS)
    assert plan.duration > faster.duration


def refusal(bench: Bench, spec: object, *keep: object) -> NotPlannable:
    with pytest.raises(NotPlannable) as refused:
        planned(bench, spec, *keep)
    return refused.value


def test_a_goal_that_violates_a_constraint_is_refused_with_the_amount(held: Bench) -> None:
    spec = {"pose": {"xyz": [0, 0, 0], "rpy": [0, 0, "30 deg"]}, "frame": "tool"}
    assert refusal(held, spec, {"upright": "10 deg"}).cause == (
        "'cup' tilts by 30.0 deg, beyond `upright: 10 deg` at its end"
    )


def test_a_line_that_violates_a_constraint_is_refused_with_the_time(held: Bench) -> None:
    X = held.planner.tool_pose(held.now)
    spec = {"point": [float(X.p[0]), float(X.p[1]), float(X.p[2]) - 0.08], "path": "linear"}
    found = refusal(held, spec, {"above": "desk", "by": "10 cm"})
    said = r"'cup' is 55\.\d mm above the top of 'desk', beyond `above: desk, by: 100 mm` at t = 0\.3\d+ s"
    assert re.fullmatch(said, found.cause), found.cause


def test_a_volume_that_is_left_is_refused_with_the_axis(held: Bench) -> None:
    p = held.body("cup").p
    box = {"centre": [float(p[0]), float(p[1]), float(p[2]) + 0.05], "size": [0.1, 0.1, 0.4]}
    spec = {**ACROSS, "path": "linear"}
    assert "leaves `inside: {box: ...}` by 18" in refusal(held, spec, {"inside": {"box": box}}).cause
    wide = {**box, "size": [0.8, 0.8, 0.8]}
    planned(held, spec, {"inside": {"box": wide}})


def test_contents_stay_in_the_cup_unless_the_move_is_to_tilt_it(held: Bench) -> None:
    """`derived`: nothing is stated."""
    over = {"pose": {"xyz": [0, 0, 0.05], "rpy": [0, 0, "60 deg"]}, "frame": "tool"}
    assert tilt(cups(held, planned(held, over))) == pytest.approx(60.0, abs=0.1)


POST = """
  desk: {box: {size: [0.6, 1.2, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}
  cup: {cup: {radius: 36 mm, height: 110 mm, wall: 4 mm}, mass: 150 g, rests_on: desk, at: [0.68, -0.3]}
  ball: {sphere: {radius: 14 mm}, mass: 10 g, inside: cup}
  post: {box: {size: [6 cm, 6 cm, 40 cm]}, rests_on: desk, at: [0.75, 0], fixed: true}
"""


def test_a_cup_with_contents_is_carried_upright_around_an_obstacle(bench: Callable[..., Bench]) -> None:
    """Nothing is stated: 20 deg. Neither the tool's line nor the straight joint path is free."""
    told = bench(scene=POST)
    told.do("pick", PICK)
    told.do("lift", {"object": "cup", "by": 0.1})
    assert told.planner.contents(told.now, "cup") == ("ball",)
    told.planner.searching()  # as the straight candidates do
    searching = told.planner.searching_paths()
    assert searching is not None
    builder = MotionBuilder(searching, told.now)
    X_WT = Transform.of(xyz=(0.0, 0.6, 0.0)) @ told.planner.tool_pose(told.now)
    carry(searching, builder, "carry", X_WT, speed=0.5)
    (moved,) = builder.plan().motions
    assert moved.label == "carry" and moved.trajectory is not None
    q = np.tile(told.now.position, (len(moved.trajectory.positions), 1))
    q[:, told.robot.indices(moved.trajectory.names)] = moved.trajectory.positions
    X_TO = np.linalg.inv(told.tool(told.now.position)) @ told.body("cup").matrix
    X_WO = np.array([told.tool(row) @ X_TO for row in q[::10]])
    assert tilt(X_WO) <= 20.0
    beside = np.abs(X_WO[:, 1, 3]).argmin()
    assert np.hypot(X_WO[beside, 0, 3] - 0.75, X_WO[beside, 1, 3]) > 0.036 + 0.03 or X_WO[beside, 2, 3] > 0.8


def test_an_empty_hand_has_nothing_to_keep_upright(bench: Callable[..., Bench]) -> None:
    told = bench()
    spec = {"to": {"joint_1": -0.5, "joint_6": 0.9}}
    one, other = planned(told, spec), planned(told, spec, {"upright": "1 deg"}, {"slosh": "1 deg"})
    assert one.duration == other.duration


def test_projection_ends_on_the_constraint() -> None:
    """The unit disc: from outside to its edge, from inside nowhere."""

    def margin(q: Array) -> Array:
        return np.asarray(1.0 - np.linalg.norm(q, axis=1))

    found = kept_problem.projected(margin, np.array([3.0, 4.0]), 0.1)
    assert found is not None
    assert 0.1 <= margin(found[None])[0] <= 0.4
    assert found[1] / found[0] == pytest.approx(4.0 / 3.0)
    inside = np.array([0.1, 0.2])
    np.testing.assert_array_equal(kept_problem.projected(margin, inside, 0.1), inside)


def test_states_are_not_changed(held: Bench) -> None:
    before: PlanningState = held.now
    planned(held, ACROSS, {"tool_speed": 0.2})
    assert held.now is before
