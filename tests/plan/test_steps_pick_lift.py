"""`pick` and `lift`: where the tool goes, by the description's joints multiplied by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable

Make = Callable[..., Any]  # fixtures of conftest.py: a Bench of a robot and a scene; steps already planned on one
Story = Any

GRASP = {"posture": "wrap", "height": "68 mm"}


def test_a_pick_from_the_side_ends_level_at_the_asked_height_with_the_fingers_closing_sideways(story: Story) -> None:
    """The tool's z is the direction of approach: horizontal, towards the cup; its y, the closing direction, too."""
    before, plan = story.steps["pick"]
    X_WT = story.bench.tools(before, plan, "approach")[-1]
    x, y, z, p = X_WT[:3, 0], X_WT[:3, 1], X_WT[:3, 2], X_WT[:3, 3]
    np.testing.assert_allclose(p, [0.75, 0.0, 0.4 + 0.068], atol=2e-5)  # the inverse kinematics' 1e-5 m
    assert abs(z[2]) < 2e-4
    assert abs(y[2]) < 2e-4
    assert abs(x[2]) == pytest.approx(1.0)
    assert z[:2] @ p[:2] > 0.9 * np.linalg.norm(p[:2])  # away from the robot, which stands at the origin


def test_the_approach_is_straight_and_comes_down_no_steeper_than_it_says(story: Story) -> None:
    before, plan = story.steps["pick"]
    X = story.bench.tools(before, plan, "approach")
    p, R = X[:, :3, 3], X[:, :3, :3]
    way = p[-1] - p[0]
    along = way / np.linalg.norm(way)
    assert 0.08 - 1e-4 <= way @ R[-1, :, 2] <= 0.14 + 1e-4  # `distance`, along the axis of the tool
    assert -np.tan(np.radians(30.0)) - 1e-3 <= way[2] / np.linalg.norm(way[:2]) <= 1e-3
    off = (p - p[0]) - np.outer((p - p[0]) @ along, along)
    assert np.linalg.norm(off, axis=1).max() < 1e-4
    np.testing.assert_allclose(R, np.broadcast_to(R[-1], R.shape), atol=1e-3)


def test_the_hand_opens_on_the_way_and_closes_on_the_cup(story: Story) -> None:
    """The predicted fingers stop between open (0) and the posture: the cup is in between."""
    before, plan = story.steps["pick"]
    assert [motion.label for motion in plan.motions] == ["reach", "approach", "close"]
    assert before.carried is None
    assert plan.end.carried is not None
    assert plan.end.carried.body == "cup"
    close = plan.motions[-1].grip
    robot = story.bench.robot
    fingers = plan.end.position[robot.indices(close.joints)]
    assert (fingers > 0.02).all()
    assert (fingers < close.target).all()


def test_the_predicted_fingers_touch_the_cup(story: Story) -> None:
    """Closed 0.05 rad less nothing touches; as predicted every finger does."""
    _, plan = story.steps["pick"]
    planner, robot = story.bench.planner, story.bench.robot
    query = planner.grasping(plan.end, "cup")
    touching = {hit.b for hit in query.every(plan.end.position)}
    for k in (1, 2, 3):
        assert any(f"finger_{k}" in name for name in touching)
    less = np.array(plan.end.position)
    less[robot.indices(planner.gripper_joints)] -= 0.05
    assert not query.touches(less)


def test_a_pick_from_above_comes_down_on_the_block(bench: Make) -> None:
    panda = bench("panda")
    before = panda.now
    plan = panda.do("pick", {"object": "block", "approach": {"from": "top", "distance": "10 cm"}})
    X = panda.tools(before, plan, "approach")
    np.testing.assert_allclose(X[:, :3, 2], np.broadcast_to([0.0, 0.0, -1.0], (40, 3)), atol=1e-3)
    np.testing.assert_allclose(X[-1, :3, 3], [0.5, -0.15, 0.225], atol=2e-5)
    np.testing.assert_allclose(X[0, :3, 3], [0.5, -0.15, 0.325], atol=2e-5)
    y = np.abs(X[-1, :3, 1])
    assert max(y[0], y[1]) == pytest.approx(1.0, abs=1e-6)  # along an edge of the block
    # Its two fingers, the second the mimic of the first, stop at half the block's 40 mm, within the step of prediction.
    fingers = plan.end.position[panda.robot.indices(("panda_finger_joint1", "panda_finger_joint2"))]
    assert fingers[0] == fingers[1]
    assert 0.015 < fingers[0] <= 0.021


@pytest.mark.parametrize("joint_7", ["45 deg", "-135 deg"])
def test_of_two_fingers_that_may_change_places_the_hand_takes_the_shorter_turn(bench: Make, joint_7: str) -> None:
    panda = bench("panda")
    if joint_7 != "45 deg":  # home
        panda.do("move", {"to": {"panda_joint7": joint_7}})
    before = panda.now
    x_before = panda.planner.tool_pose(before).R[:, 0]
    plan = panda.do("pick", {"object": "block", "approach": {"from": "top"}})
    x = panda.tools(before, plan, "approach")[-1, :3, 0]
    assert x @ x_before > 0.9


def test_what_cannot_be_taken_from_the_side_is_taken_from_above_unless_the_side_was_asked_for(bench: Make) -> None:
    """Between a low block and the table there is no room for the Panda's broad hand."""
    panda = bench("panda")
    refusal = panda.refused("pick", {"object": "block", "approach": {"from": "side"}})
    assert "table" in refusal.cause
    # A direction about the vertical is one from the side, too.
    refusal = panda.refused("pick", {"object": "block", "approach": {"yaw": "0 deg"}})
    assert "table" in refusal.cause
    before = panda.now
    plan = panda.do("pick", {"object": "block"})
    X = panda.tools(before, plan, "approach")
    np.testing.assert_allclose(X[:, :3, 2], np.broadcast_to([0.0, 0.0, -1.0], (40, 3)), atol=1e-3)


def test_a_given_yaw_is_the_direction_of_approach(bench: Make) -> None:
    arm = bench()
    before = arm.now
    plan = arm.do("pick", {"object": "cup", "approach": {"yaw": "-12 deg"}, "grasp": GRASP})
    z = arm.tools(before, plan, "approach")[-1][:3, 2]
    np.testing.assert_allclose(z, [np.cos(np.radians(-12)), np.sin(np.radians(-12)), 0.0], atol=2e-4)


def test_a_lift_is_vertical_and_turns_nothing(story: Story) -> None:
    before, plan = story.steps["lift"]
    X = story.bench.tools(before, plan, "lift")
    p, R = X[:, :3, 3], X[:, :3, :3]
    np.testing.assert_allclose(p[:, :2], np.broadcast_to(p[0, :2], (40, 2)), atol=1e-4)
    np.testing.assert_allclose(R, np.broadcast_to(R[0], R.shape), atol=1e-3)
    assert (np.diff(p[:, 2]) >= -1e-6).all()
    assert p[-1, 2] - p[0, 2] == pytest.approx(0.14, abs=2e-5)  # the middle of the default 8 to 20 cm
    bench = story.bench
    np.testing.assert_allclose(bench.body("cup", plan.end).p - bench.body("cup", before).p, [0, 0, 0.14], atol=1e-4)
    # The ball lies in the cup and goes with it.
    np.testing.assert_allclose(bench.body("ball", plan.end).p - bench.body("ball", before).p, [0, 0, 0.14], atol=1e-4)


def test_one_height_is_taken_as_it_is(bench: Make, story: Story) -> None:
    arm = bench()
    arm.now = story.steps["lift"][0]
    plan = arm.plan("lift", {"object": "cup", "by": "5 cm"})
    assert arm.body("cup", plan.end).p[2] - 0.4 == pytest.approx(0.05, abs=1e-4)


def test_what_cannot_be_lifted_or_put_so_far_is_told_what_those_steps_can_do_about_it(
    bench: Make, story: Story
) -> None:
    """A straight line of a `lift` or a `place` is no `move`, of which another path could be asked."""
    arm = bench()
    arm.now = story.steps["pick"][1].end
    lift = arm.refused("lift", {"object": "cup", "by": 1.5})
    arm.now = story.steps["lift"][1].end
    place = arm.refused("place", {"object": "cup", "at": [1.12, 0.45], "onto": "desk"})
    assert "the end of the straight line, (" in lift.cause and "the end of the straight line, (" in place.cause
    assert (lift.hint or "").startswith("lift it less, `by: ...`; or ")
    assert (place.hint or "").startswith("place it within reach, `at: [x, y]`; or ")


def test_what_is_not_held_is_not_lifted(bench: Make, story: Story) -> None:
    arm = bench()
    for verb, spec in (("lift", {}), ("pour", {"into": "tray"}), ("place", {})):
        refusal = arm.refused(verb, {"object": "cup", **spec})
        assert str(refusal) == "'cup' is not held: the hand holds nothing"
        assert refusal.hint == "`pick` it first, or `grasp: {object: cup}`"
    arm.now = story.steps["lift"][0]
    assert "the hand holds 'cup'" in arm.refused("lift", {"object": "ball"}).cause


def test_a_hand_that_holds_takes_nothing_else(bench: Make, story: Story) -> None:
    arm = bench()
    arm.now = story.steps["lift"][1].end
    refusal = arm.refused("pick", {"object": "ball"})
    assert refusal.cause == "the hand cannot take 'ball': it holds 'cup'"
    assert refusal.hint == "`place` 'cup' first"
    assert arm.refused("grasp", {"object": "ball"}).cause == refusal.cause
    assert arm.refused("pick", {"object": "cup"}).cause == "'cup' is already in the hand"


def test_a_hand_that_opens_to_back_off_need_not_open_all_the_way(bench: Make, story: Story) -> None:
    """What stops it there is in the way of a `release` and of a `place`; `pick` goes on and takes its object."""
    arm = bench()
    around = story.steps["pick"][1].end
    for verb, spec, before, must in (
        ("pick", {"object": "cup", "grasp": GRASP}, replace(around, carried=None, closed=False), False),
        ("release", {}, around, True),
        ("place", {"object": "cup"}, story.steps["place"][0], True),
    ):
        arm.now = before
        opening = next(motion for motion in arm.plan(verb, spec).motions if motion.label == "open")
        assert opening.grip.must_arrive is must, verb


@pytest.mark.slow
def test_out_of_reach_says_so_once_for_all_ways(bench: Make) -> None:
    """1.26 m away; the arm ends at about 1.1 m."""
    scene = "\n  post: {box: {size: [0.1, 0.1, 0.4]}, pose: {xyz: [1.2, 0.4, 0.2]}, fixed: true}\n"
    scene += "  can: {cylinder: {radius: 3 cm, height: 10 cm}, mass: 0.1, rests_on: post, at: [1.2, 0.4]}\n"
    refusal = bench(scene=scene).refused("pick", {"object": "can", "grasp": {"posture": "wrap"}})
    assert (
        "cannot pick 'can', all 126 candidates failed: approach: no joint positions reach (1.200, 0.400, 0.450) m, 1.3"
        in (refusal.cause)
    )
    assert "(126 of 126)" in refusal.cause
    assert refusal.hint.startswith("move 'can' nearer, or change the approach, the height of the grasp")


def test_what_is_taller_than_the_fingers_is_taken_higher_from_above(bench: Make) -> None:
    """The Panda's tool is 3.9 cm from its palm, of which 4 mm stay free: half of 9 cm is too much, a third is not."""
    for size, height in ((0.05, 0.025), (0.09, 0.06), (0.14, 0.14 * 5 / 6)):
        scene = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
        scene += f"  block: {{box: {{size: [0.04, 0.04, {size}]}}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}}\n"
        arm = bench("panda", scene=scene)
        end = arm.plan("pick", {"object": "block", "approach": {"from": "top"}}).end
        assert arm.planner.tool_pose(end).p[2] - 0.2 == pytest.approx(height, abs=1e-4), size


def test_what_is_tried_next_does_not_hang_on_the_words_of_a_hint(bench: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
    scene += "  block: {box: {size: [0.04, 0.04, 0.09]}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}\n"
    tell = NotPlannable.__init__

    def reworded(self: NotPlannable, cause: str, *, hint: str | None = None, **more: Any) -> None:
        tell(self, cause, hint=f"say: {hint}", **more)

    monkeypatch.setattr(NotPlannable, "__init__", reworded)
    arm = bench("panda", scene=scene)
    end = arm.plan("pick", {"object": "block", "approach": {"from": "top"}}).end
    assert arm.planner.tool_pose(end).p[2] - 0.2 == pytest.approx(0.06, abs=1e-4)


def test_a_ball_and_what_is_too_wide_are_not_taken_higher(bench: Make) -> None:
    """Above its middle a ball slips out; the fingers are in the block however high."""
    scene = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
    scene += "  ball: {sphere: {radius: 7 cm}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}\n"
    refusal = bench("panda", scene=scene).refused("pick", {"object": "ball", "approach": {"from": "top"}})
    assert "all 36 candidates failed" in refusal.cause
    assert "`open: ...`" in refusal.hint
    assert "'ball' is wider than the hand in its pose 'open'; or change the approach" in refusal.hint


def test_a_grasp_that_the_hand_cannot_take_asks_for_another_height(bench: Make) -> None:
    refusal = bench("panda").refused("pick", {"object": "block", "approach": {"from": "top"}, "grasp": {"height": 0}})
    assert "overlap" in refusal.cause
    assert "`grasp: {height: ...}`" in refusal.hint
    assert "wider" not in refusal.hint


def test_only_a_pick_speaks_of_its_height_where_closing_fingers_have_no_room(bench: Make) -> None:
    """A plate between the block and an open finger; what a plain grasp can do about it is to come from elsewhere."""
    table = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
    block = "  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}\n"
    plate = "  plate: {box: {size: [4 cm, 4 mm, 5 cm]}, pose: {xyz: [0.5, -0.122, 0.225]}, fixed: true}\n"
    spec = {"object": "block", "approach": {"from": "top", "yaw": 0}}
    clear, narrow = bench("panda", scene=table + block), bench("panda", scene=table + block + plate)
    refusal = narrow.refused("pick", spec)
    assert "'plate'" in refusal.cause and "of 'close'" in refusal.cause
    assert "`grasp: {height: ...}`" in refusal.hint
    narrow.now, _ = clear.at(clear.now, clear.plan("pick", spec), "close")
    refusal = narrow.refused("grasp", {"object": "block"})
    assert "'plate'" in refusal.cause and "of 'close'" in refusal.cause
    assert refusal.hint == "first `move` to a pose from which the path is free"


def test_a_cup_behind_a_wall_names_the_wall_and_the_motion(bench: Make) -> None:
    wall = "  wall: {box: {size: [2 cm, 0.8, 0.15]}, pose: {xyz: [0.62, 0, 0.475]}, fixed: true}\n"
    desk = "\n  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}\n"
    can = "  can: {cylinder: {radius: 3 cm, height: 10 cm}, mass: 0.1, rests_on: desk, at: [0.72, 0]}\n"
    spec = {"object": "can", "approach": {"yaw": 0, "distance": "8 cm"}, "grasp": {"posture": "wrap"}}
    cause = bench(scene=desk + wall + can).refused("pick", spec).cause
    assert "wall" in cause
    assert "approach" in cause or "reach" in cause


def test_a_hand_that_would_close_on_nothing_is_refused(bench: Make) -> None:
    """From above, the tips of the fingers stay over the cup."""
    refusal = bench().refused("grasp", {"object": "cup", "posture": "wrap"})
    assert refusal.cause == "the hand, closed to 'wrap', does not touch 'cup'"
    assert bench().do("grasp", {"object": "cup", "posture": "wrap", "until": "posture"}).end.carried is not None


def test_unknown_names_of_a_pick_come_with_the_nearest(bench: Make) -> None:
    arm = bench()
    spec = {"object": "cups", "grasp": {"posture": "wrapp"}, "open": "opened"}
    assert arm.problems("pick", spec) == [
        (("object",), "'cups' is not a movable body of the scene", "did you mean 'cup'?"),
        (("grasp", "posture"), "robot 'arm7_hand3' has no pose 'wrapp'", "did you mean 'wrap'?"),
        (("open",), "robot 'arm7_hand3' has no pose 'opened'", "did you mean 'open'?"),
    ]
    assert arm.problems("pick", {"object": "desk", "grasp": {"posture": "wrap"}}) == [
        (("object",), "'desk' is not a movable body of the scene", "known: cup, ball")
    ]
    assert arm.problems("lift", {"object": "tray"}) == [
        (("object",), "'tray' is not a movable body of the scene", "known: cup, ball")
    ]


def test_a_hand_that_closes_on_something_unknown_stops_there(bench: Make) -> None:
    """4 cm between the fingers of the Panda: each of them travels to 2 cm; without the block they close."""
    table = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
    block = "  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}\n"
    arm = bench("panda", scene=table + block)
    plan = arm.plan("pick", {"object": "block", "approach": {"from": "top", "yaw": 0}})
    around, _ = arm.at(arm.now, plan, "close")
    columns = arm.robot.indices(arm.planner.gripper_joints)
    for start, opening in ((around, 0.02), (arm.start, 0.0)):
        arm.now = start
        done = arm.do("grasp", {"until": "posture"})
        np.testing.assert_allclose(arm.now.position[columns], opening, atol=2e-3)
        assert arm.now.closed and arm.now.carried is None
        (motion,) = done.motions
        assert motion.grip is not None
        np.testing.assert_allclose(motion.grip.target, 0.0, atol=1e-9)
