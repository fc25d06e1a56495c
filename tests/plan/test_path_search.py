"""Paths around obstacles in the motions of steps: free by brute force, within the limits, without stops, repeatable."""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.plan.candidates import first
from manipcli.plan.free_motion import line_blocked
from manipcli.plan.limit_check import verify
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path_planners.ompl import OmplSpec
from manipcli.plan.path_planners.rrt_connect import RrtConnectSpec
from manipcli.plan.path_search import PathSearch
from manipcli.plan.planner import CLEARANCE
from manipcli.plan.steps import STEPS
from manipcli.plan.sweep import swept
from manipcli.spec.planner import PlannerSpec
from tests.plan.conftest import Bench

SCENE = """
  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}
  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}
"""
WALL = "  wall: {box: {size: [0.5, 0.02, 0.3]}, pose: {xyz: [0.55, 0.02, 0.35]}, fixed: true}\n"
TURN = 0.5
"""[rad] Of the first joint, to both sides of the wall."""
RIGHT = {"pose": {"xyz": [0.5, -0.25, 0.28], "rpy": ["180 deg", 0, 0]}}
Make = Callable[..., Bench]


def searched(bench: Bench, verb: str, spec: object, paths: PlannerSpec | None = None) -> StepPlan:
    """The plan of a step, straight first, then searched."""
    bench.planner._paths = paths or RrtConnectSpec()
    step = STEPS[verb]
    body = step.spec.model_validate(spec)
    return first(step.ways(body, bench.planner, bench.now))


def done(bench: Bench, verb: str, spec: object) -> StepPlan:
    planned = searched(bench, verb, spec)
    bench.now = planned.end
    return planned


def assert_free(bench: Bench, before: PlanningState, plan: StepPlan, label: str) -> Array:
    """Brute force over a motion, with the hand's own: configurations at most 1 mrad apart, at half the clearance."""
    state, motion = bench.at(before, plan, label)
    _, positions = swept(bench.planner, state, motion.trajectory, motion.grip)
    carried = before.carried
    allowed = frozenset() if carried is None else bench.planner.hand_contacts(carried.body)
    query = bench.planner.checker.at(before.bodies, carried=carried, ignore=allowed, margin=CLEARANCE / 2)
    walked = np.concatenate(([0.0], np.cumsum(np.max(np.abs(np.diff(positions, axis=0)), axis=1))))
    wanted = np.linspace(0.0, walked[-1], int(np.ceil(walked[-1] / 1e-3)) + 1)
    dense = np.stack([np.interp(wanted, walked, column) for column in positions.T], axis=1)
    assert not any(query.touches(q) for q in dense)
    return np.asarray(positions)


def assert_timed(bench: Bench, plan: StepPlan, label: str) -> None:
    """Within velocity, acceleration and jerk, and never at rest between its ends."""
    motion = next(motion for motion in plan.motions if motion.label == label)
    trajectory = motion.trajectory
    assert trajectory is not None
    assert trajectory.velocities is not None
    verify(trajectory, MotionLimits.of(bench.robot, trajectory.names))
    k = len(trajectory.times)
    assert np.linalg.norm(trajectory.velocities[k // 10 : -k // 10], axis=1).min() > 0.02


def at_right(bench: Bench) -> Bench:
    """With the tool low at the right of the wall, the elbow above it."""
    solver = bench.planner.solver
    found = solver.track(Transform.of(xyz=(0.56, 0.0, 0.3), R=np.diag([1.0, -1.0, -1.0])), bench.now.position)
    assert found.converged
    q = np.array(found.q)
    q[0] = -TURN
    bench.now = bench.now.moved(q)
    return bench


def left(bench: Bench) -> dict[str, object]:
    """The present configuration, with the arm turned to the other side of the wall."""
    angles = {f"panda_joint{k + 1}": float(bench.now.position[k]) for k in range(7)}
    return {"to": {**angles, "panda_joint1": TURN}}


@pytest.fixture
def divided(bench: Make) -> Bench:
    """The tool low at the right of a wall."""
    return at_right(bench("panda", scene=SCENE + WALL))


def test_a_move_leads_around_a_wall(divided: Bench) -> None:
    before, goal = divided.now, left(divided)
    with pytest.raises(NotPlannable, match="'wall'"):
        divided.plan("move", goal)
    plan = searched(divided, "move", goal)
    positions = assert_free(divided, before, plan, "move")
    assert_timed(divided, plan, "move")
    assert np.allclose(positions[-1, 1:], before.position[1:], atol=1e-12)
    assert positions[-1, 0] == pytest.approx(TURN)


def test_a_pose_is_reached_with_any_configuration_of_the_arm(divided: Bench) -> None:
    before = divided.now
    plan = searched(divided, "move", {"pose": {"xyz": [0.5, 0.2, 0.28], "rpy": ["180 deg", 0, 0]}})
    assert_free(divided, before, plan, "move")
    assert np.allclose(divided.tool(plan.end.position)[:3, 3], (0.5, 0.2, 0.28), atol=1e-4)


def test_where_the_straight_path_is_free_it_is_the_plan(bench: Make) -> None:
    made, other = bench("panda", scene=SCENE), bench("panda", scene=SCENE)
    straight, plan = made.plan("move", RIGHT), searched(other, "move", RIGHT)
    (first,), (second,) = straight.motions, plan.motions
    assert first.trajectory is not None
    assert second.trajectory is not None
    assert first.trajectory.positions.tobytes() == second.trajectory.positions.tobytes()


def test_the_same_seed_gives_the_same_bytes(bench: Make) -> None:
    found = []
    for _ in range(2):
        made = bench("panda", scene=SCENE + WALL)
        at_right(made)
        (motion,) = done(made, "move", left(made)).motions
        assert motion.trajectory is not None
        found.append(motion.trajectory.positions.tobytes())
    assert found[0] == found[1]


def test_the_hand_may_move_at_the_same_time(divided: Bench) -> None:
    """The fingers open while the arm goes around the wall: free with the fingers where they are at each time."""
    done(divided, "move", {"to": "closed"})
    before = divided.now
    goal = left(divided)["to"]
    assert isinstance(goal, dict)
    plan = searched(divided, "move", {"to": {**goal, "panda_finger_joint1": 0.04}})
    positions = assert_free(divided, before, plan, "move")
    assert positions[0, 7] == pytest.approx(0.0)
    assert positions[-1, 7:] == pytest.approx([0.04, 0.04])


def test_a_held_object_is_carried_around(bench: Make) -> None:
    made = bench("panda", scene=SCENE + WALL)
    for verb, spec in (
        ("pick", {"object": "block", "approach": {"from": "top"}, "grasp": {"posture": "closed", "force": 7.0}}),
        ("lift", {"object": "block", "by": 0.06}),
    ):
        done(made, verb, spec)
    before = made.now
    plan = searched(made, "place", {"object": "block", "at": [0.5, 0.2], "onto": "table"})
    assert_free(made, before, plan, "carry")
    assert made.body("block", plan.end).p == pytest.approx([0.5, 0.2, 0.225], abs=1e-6)


def test_without_samples_only_straight_paths_are_tried(divided: Bench) -> None:
    with pytest.raises(NotPlannable) as refusal:
        searched(divided, "move", left(divided), RrtConnectSpec(samples=0))
    assert "no path around" not in refusal.value.cause


def test_a_joint_path_is_not_searched(divided: Bench) -> None:
    with pytest.raises(NotPlannable, match=r"within 4 mm of 'wall'|overlap"):
        searched(divided, "move", {**left(divided), "path": "joint"})


def test_a_search_that_ends_too_early_says_where_it_was_narrow(divided: Bench) -> None:
    with pytest.raises(NotPlannable) as refusal:
        searched(divided, "move", left(divided), RrtConnectSpec(samples=1, range=0.05))
    cause, hint = refusal.value.cause, refusal.value.hint
    assert "no path around obstacles" in cause
    assert "within 1 sample" in cause
    assert "narrowest place found" in cause
    assert "'wall'" in cause
    assert hint is not None
    assert "move 'wall' away" in hint
    assert "samples" in hint


def test_ompl_is_named_where_it_is_not_installed(divided: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ompl", None)
    with pytest.raises(NotPlannable) as refusal:
        searched(divided, "move", left(divided), OmplSpec())
    assert refusal.value.hint is not None
    assert "manipcli[ompl]" in refusal.value.hint


def test_a_line_that_is_surely_blocked_is_refused_by_its_plan_too(divided: Bench) -> None:
    """Over and beside the wall: what a look refuses has no plan, and most of what has none is seen at a look."""
    bench = divided
    seen = blocked = 0
    start = bench.planner.tool_pose(bench.now)
    for y in np.linspace(-0.1, 0.5, 6).tolist():
        for z in (0.0, 0.15, 0.3):
            X_WT = Transform(start.R, start.p + np.array([0.0, y, z]))
            look = line_blocked(bench.planner, bench.now, X_WT, bench.planner.query(bench.now))
            builder = MotionBuilder(bench.planner, bench.now)
            try:
                builder.straight("carry", X_WT, speed=1.0)
            except NotPlannable:
                blocked += 1
                seen += look is not None
            else:
                assert look is None
    assert 0 < blocked < 18
    assert seen >= 0.8 * blocked


def test_a_search_with_hardly_a_sample_left_repeats_what_one_with_enough_said(divided: Bench) -> None:
    planner, state = divided.planner, divided.now
    search = PathSearch.of(RrtConnectSpec(samples=40, range=0.01), np.random.default_rng(0))
    arm = tuple(f"panda_joint{k}" for k in range(1, 8))
    goal = np.array(state.position[list(planner.robot.indices(arm))])
    goal[0] += 2 * TURN
    told = []
    while search.left > 0:
        with pytest.raises(NotPlannable) as refusal:
            search.path(planner.robot, state, planner.query(state), arm, goal[None], None)
        told.append(int(refusal.value.cause.partition("within ")[2].partition(" sample")[0]))
    assert told[:2] == [40, 20]
    assert len(told) > 5
    assert min(told) >= 2
