"""Clearances: what is kept, what may touch, what moves along with a held cup, and how near a plan comes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.clearance import least_distance
from manipcli.model.collision import CollisionQuery, pairs
from manipcli.model.configuration import with_joints
from manipcli.plan.clearance import least_clearance
from manipcli.plan.planner import CLEARANCE
from manipcli.plan.sweep import first_hit
from manipcli.plan.trajectory import JointTrajectory
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

Make = Callable[..., Any]  # fixtures of conftest.py: a Bench of a robot and a scene; steps already planned on one
Story = Any

ROOT = Path(__file__).parents[2]
HEAPED = """
  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}
  cup: {cup: {radius: 35 mm, height: 110 mm, wall: 3 mm}, mass: 150 g, rests_on: desk, at: [0.75, 0.0]}
  egg: {box: {size: [2 cm, 2 cm, 115 mm]}, mass: 10 g, inside: cup}
  hat: {sphere: {radius: 2 cm}, mass: 10 g, pose: {xyz: [0.75, 0.0, 0.538]}}
  block: {box: {size: [2 cm, 2 cm, 2 cm]}, mass: 10 g, rests_on: desk, at: [0.75, 0.3]}
"""


def brute_force(query: CollisionQuery, configurations: Array) -> float:
    """The least distance of all pairs of shapes in all configurations."""
    geometry, _ = query.shapes
    model = query.kinematics.model
    data, state = model.createData(), geometry.createData()
    found = np.inf
    for q in configurations:
        pin.computeDistances(model, data, geometry, state, q)
        found = min(found, *(result.min_distance for result in state.distanceResults))
    return float(found)


def test_the_least_distance_is_that_of_all_pairs(bench: Make) -> None:
    arm = bench()
    rng = np.random.default_rng(2)
    query = arm.planner.query(arm.start)
    for _ in range(3):
        ends = arm.start.position + rng.uniform(-0.4, 0.4, (2, len(arm.start.position)))
        path = ends[0] + np.linspace(0.0, 1.0, 30)[:, None] * (ends[1] - ends[0])
        found = least_distance(query, path)
        assert found is not None
        k, hit = found
        assert hit.distance == pytest.approx(brute_force(query, path), abs=1e-6)
        assert hit.distance == pytest.approx(brute_force(query, path[k : k + 1]), abs=1e-6)


def test_a_plan_keeps_its_clearance_in_every_motion(bench: Make, story: Story) -> None:
    arm = story.bench
    seen = 0
    for _, planned in story.steps.values():
        begins = [motion.begins for motion in planned.motions]
        for motion, end in zip(planned.motions, [*begins[1:], planned.end], strict=True):
            near = least_clearance(arm.planner, motion, end or planned.end)
            assert (near is None) == (motion.trajectory is None and motion.grip is None)
            if near is not None:
                seen += 1
                assert near.distance > CLEARANCE - 1e-4, motion.label
                assert 0.0 <= near.time <= motion.duration + 1e-9
                assert {near.a, near.b} != {"cup", "desk"}  # it stands there
    assert seen >= 8


def test_a_pair_keeps_its_own_clearance_and_the_message_states_it(bench: Make) -> None:
    arm = bench(scene=HEAPED)
    planner = arm.planner
    hand = next(iter(pairs([planner.tool_link], "block")))
    X_WT = planner.tool_pose(arm.start)
    inside = Transform.of(xyz=X_WT.p)
    gaps = {}
    for shift in (0.1, 0.2):
        there = inside @ Transform.of(xyz=(shift, 0.0, 0.0))
        bodies = list(arm.start.bodies)
        bodies[[body.name for body in arm.scene.movable].index("block")] = there
        state = replace(arm.start, bodies=tuple(bodies))
        found = least_distance(planner.checker.at(state.bodies, only="block"), state.position[None])
        assert found is not None
        gaps[shift] = (state, found[1])
    state, near = gaps[0.2]
    assert near.distance > 0.01 and hand
    pair = frozenset((near.a, near.b))
    for distance, kept in ((near.distance - 1e-4, True), (near.distance + 1e-4, False)):
        planner.clearances = {pair: distance}
        planner._queries.clear()
        if kept:
            planner.free_start(state)
            continue
        with pytest.raises(NotPlannable, match=f"within {1000 * distance:.3g} mm of"):
            planner.free_start(state)
        planner.allowing(frozenset([(near.b, near.a)])).free_start(state)


def test_what_is_in_and_on_a_cup_moves_with_it_and_collides(bench: Make) -> None:
    arm = bench(scene=HEAPED)
    assert arm.planner.contents(arm.start, "cup") == ("egg", "hat")  # the hat is above the brim, on the egg
    grasp = {"posture": "wrap", "height": "68 mm"}
    arm.do("pick", {"object": "cup", "approach": {"yaw": 0}, "grasp": grasp})
    arm.do("lift", {"object": "cup"})
    top = arm.body("hat").p + np.array([0.0, 0.0, 0.02 + 0.01])  # of a block whose lower face touches the hat
    assert arm.body("hat").p[2] > 0.56  # lifted along
    names = [body.name for body in arm.scene.movable]
    for gap in (CLEARANCE - 1e-4, CLEARANCE + 1e-4):
        bodies = list(arm.now.bodies)
        bodies[names.index("block")] = Transform.of(xyz=top + np.array([0.0, 0.0, gap]))
        hit = arm.planner.query(replace(arm.now, bodies=tuple(bodies))).check(arm.now.position)
        assert (hit is not None) == (gap < CLEARANCE)
        if hit is not None:
            assert {hit.a, hit.b} == {"hat", "block"} and hit.distance == pytest.approx(gap, abs=1e-6)


def test_what_only_stands_above_a_cup_is_not_its_content(bench: Make) -> None:
    arm = bench(scene=HEAPED.replace("0.538]", "0.558]"))  # 2 cm above the egg
    assert arm.planner.contents(arm.start, "cup") == ("egg",)


def task(folder: Path, more: str, step: str) -> Path:
    path = folder / "task.yaml"
    path.write_text(
        f"task: t\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: {ROOT}/controllers/arm7_hand3.yaml\n"
        "scene:\n  post: {box: {size: [2 cm, 2 cm, 1 m]}, pose: {xyz: [0.6, 0.6, 0.5]}, fixed: true}\n"
        f"{more}\nsteps:\n  - {step}\n"
    )
    return path


def test_a_step_may_allow_what_a_clearance_forbids(tmp_path: Path) -> None:
    move = "move: {to: {joint_1: 20 deg}}"
    free = plan_task(load_task(task(tmp_path, "", move), allow_outside=True))
    (near,) = free.clearances()
    assert near is not None
    wide = "clearance: {pairs: [{between: [robot, post], distance: 1 m}]}"
    with pytest.raises(NotPlannable, match=r"'post'.* within 1e\+03 mm|within 1e\+03 mm of 'post'|within 1000 mm"):
        plan_task(load_task(task(tmp_path, wide, move), allow_outside=True))
    allowed = plan_task(load_task(task(tmp_path, wide, f"{move}\n    allow: [[robot, post]]"), allow_outside=True))
    first, second = free.motions[0].trajectory, allowed.motions[0].trajectory
    assert first is not None and second is not None
    np.testing.assert_array_equal(first.positions, second.positions)


@pytest.mark.parametrize(
    ("more", "step", "message", "line"),
    [
        ("", "wait: 1 s\n    allow: [[robot/pam, post]]", "'robot/pam' is not a body of the scene or a part", 9),
        ("", "wait: 1 s\n    allow: [[post, post]]", "'post' is in the pair twice", 9),
        ("clearance: {pairs: [{between: [palm, post], distance: 1 cm}]}", "wait: 1 s", "'palm' is not a body", 6),
        ("clearance: {default: -1 mm}", "wait: 1 s", "must be at least 0", 6),
    ],
)
def test_pairs_of_unknown_parts_are_found(tmp_path: Path, more: str, step: str, message: str, line: int) -> None:
    with pytest.raises(InvalidInput) as raised:
        load_task(task(tmp_path, more, step), allow_outside=True)
    (finding,) = raised.value.findings
    assert message in finding.message and finding.place is not None and finding.place.line == line


def test_what_is_poured_may_touch_where_it_is_poured(bench: Make) -> None:
    """A heap above the brim is lower than the lip when the cup is tilted by more than a right angle."""
    scene = HEAPED.replace(
        "block: ", "bowl: {cup: {radius: 6 cm, height: 9 cm}, rests_on: desk, at: [0.7, -0.3], mass: 0.3}\n  block: "
    )
    arm = bench(scene=scene)
    arm.do("pick", {"object": "cup", "approach": {"yaw": 0}, "grasp": {"posture": "wrap", "height": "68 mm"}})
    arm.do("lift", {"object": "cup"})
    arm.do("pour", {"object": "cup", "into": "bowl", "tilt": "125 deg"})
    assert arm.planner.contents(arm.now, "bowl") == ("egg", "hat")


def test_pairs_that_a_step_allows_have_no_clearance(tmp_path: Path) -> None:
    """Also not where they are the nearest: then the next pair counts."""
    move = "move: {to: {joint_1: 20 deg}}"
    (near,) = plan_task(load_task(task(tmp_path, "", move), allow_outside=True)).clearances()
    assert near is not None
    pair = f"[{near.a}, {near.b}]"
    (next_,) = plan_task(load_task(task(tmp_path, "", f"{move}\n    allow: [{pair}]"), allow_outside=True)).clearances()
    assert next_ is not None
    assert (next_.a, next_.b) != (near.a, near.b) and next_.distance >= near.distance


@pytest.mark.parametrize("clearance", [0.0, CLEARANCE])
def test_nothing_is_passed_between_two_points(bench: Make, clearance: float) -> None:
    """The arm swings through a thin post between two free points of a trajectory, without a clearance, too."""
    arm = bench(scene="\n  post: {box: {size: [1 cm, 1 cm, 2.0]}, pose: {xyz: [0.39, 0.21, 1.0]}, fixed: true}\n")
    arm.planner.clearance = clearance
    query = arm.planner.query(arm.start)
    swing = JointTrajectory.of_arrays(("joint_1",), [0.0, 1.0], [[0.0], [1.0]])
    ends = with_joints(arm.robot, arm.start.position, swing.names, swing.positions)
    assert not any(query.touches(q) for q in ends)
    hit = first_hit(arm.planner, arm.start, query, swing, None)
    assert hit is not None and "post" in (hit.a, hit.b)
