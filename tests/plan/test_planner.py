"""The planner's answers about a situation, and what a builder accepts."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Transform, frozen
from manipcli.model.collision import Carried, CollisionHit
from manipcli.model.configuration import with_mimics
from manipcli.model.robot import RobotModel
from manipcli.plan.hand import fingers, moved_links, ramp
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import CLEARANCE, TOUCHING, Planner

Make = Callable[..., Any]  # fixtures of conftest.py: a Bench of a robot and a scene; steps already planned on one
Story = Any


def test_the_tool_is_where_the_joints_of_the_description_have_it(bench: Make) -> None:
    rng = np.random.default_rng(0)
    for arm in (bench(), bench("panda")):
        for _ in range(5):
            q = rng.uniform(-0.5, 0.5, len(arm.robot.joint_names))
            found = arm.planner.tool_pose(replace(arm.start, position=frozen(q)))
            np.testing.assert_allclose(found.matrix, arm.tool(q), atol=1e-12)


def test_the_arm_is_what_moves_the_tool_without_the_hand(bench: Make) -> None:
    assert bench().planner.solver.joints == tuple(f"joint_{k}" for k in range(1, 8))
    assert bench("panda").planner.solver.joints == tuple(f"panda_joint{k}" for k in range(1, 8))


def planner(robot: RobotModel, bench: Make) -> Planner:
    return Planner(
        robot, bench().scene, period=1e-3, rng=np.random.default_rng(0), gripper_joints=(), gripper_speed=1.0
    )


def test_a_robot_without_tool_moves_its_joints_and_says_what_is_missing(
    bench: Make, make_arm7: Callable[..., RobotModel]
) -> None:
    alone = planner(make_arm7(), bench)
    here = replace(bench().start, position=frozen(np.zeros(9)))
    builder = MotionBuilder(alone, here)
    builder.joints("move", ("joint_1",), (0.3,))
    assert builder.plan().end.position[0] == pytest.approx(0.3)
    with pytest.raises(NotPlannable, match="robot 'arm7' has no tool frame") as refusal:
        builder.reach("move", Transform.of(xyz=(0.5, 0.0, 0.5)))
    assert refusal.value.hint == "add `tool: {link: ...}` to the robot file"


def test_a_robot_without_gripper_controller_says_so_when_it_is_to_grasp(bench: Make) -> None:
    arm = bench()
    alone = planner(arm.robot, bench)
    for act in (
        lambda builder: builder.close("wrap", force=8.0, must_hold=True, body="cup"),
        lambda builder: builder.open("open"),
    ):
        with pytest.raises(NotPlannable, match=r"pose '\w+' has no joint that a gripper controller moves"):
            act(MotionBuilder(alone, arm.start))


def test_what_stands_on_something_touches_it_and_nothing_else(bench: Make, story: Story) -> None:
    arm = bench()
    assert arm.planner.touching(arm.start, "cup") == {("ball", "cup"), ("cup", "desk")}
    lifted = story.steps["lift"][1].end
    assert ("cup", "desk") not in arm.planner.touching(lifted, "cup")
    assert TOUCHING > CLEARANCE  # else what stands between the two could never be lifted


def test_a_cup_close_beside_something_can_be_lifted(bench: Make) -> None:
    """4.2 mm beside a wall: nearer than it counts as touching, further than the clearance."""
    scene = """
  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}
  can: {cylinder: {radius: 3 cm, height: 11 cm}, mass: 150 g, rests_on: desk, at: [0.75, 0.0]}
  wall: {box: {size: [2 cm, 6 cm, 2 cm]}, rests_on: desk, at: [0.7942, 0.0], fixed: true}
"""
    for nearer in (0.0, 0.002):
        arm = bench(scene=scene.replace("0.7942", f"{0.7942 - nearer}"))
        grasp = {"posture": "wrap", "height": "80 mm"}
        arm.do("pick", {"object": "can", "approach": {"yaw": 0}, "grasp": grasp})
        arm.do("lift", {"object": "can"})


def test_contents_are_what_lies_in_the_hollow(bench: Make, story: Story) -> None:
    arm = bench()
    assert arm.planner.contents(arm.start, "cup") == ("ball",)
    assert arm.planner.contents(arm.start, "tray") == ()
    assert arm.planner.contents(arm.start, "desk") == ()
    assert arm.planner.contents(story.steps["pour"][1].end, "cup") == ()
    assert arm.planner.contents(story.steps["pour"][1].end, "tray") == ("ball",)


def test_questions_that_do_not_differ_are_one_query(bench: Make, story: Story) -> None:
    arm = bench()
    ask = arm.planner.query
    assert ask(arm.start) is ask(replace(arm.start, position=frozen(np.zeros(13))))
    lifted = story.steps["lift"][1].end
    assert ask(lifted) is not ask(arm.start)
    moved = (arm.start.bodies[0] @ Transform.of(xyz=(0, 0.1, 0)), arm.start.bodies[1])
    assert ask(replace(arm.start, bodies=moved)) is not ask(arm.start)


def test_the_way_of_the_hand_is_checked_too(bench: Make) -> None:
    """A post between the fingers and the thumb: the arm does not move, the hand would close on it."""
    arm = bench()
    place = arm.tool(arm.start.position)[:3, 3].round(3).tolist()
    post = f"  post: {{box: {{size: [1 cm, 1 cm, 30 cm]}}, pose: {{xyz: {place}}}, fixed: true}}"
    blocked = bench(scene=f"\n{post}\n", more="floor: false")
    cause = blocked.refused("move", {"to": "wrap"}).cause
    assert "'post' comes within 4 mm of 'robot/finger_" in cause
    assert "s of 'move'" in cause


def test_a_finger_is_the_joints_below_one_another(bench: Make) -> None:
    arm, panda = bench(), bench("panda")
    assert fingers(arm.robot, arm.planner.gripper_joints) == ((0, 1), (2, 3), (4, 5))
    assert fingers(panda.robot, ("panda_finger_joint1",)) == ((0,),)
    outermost_first = arm.planner.gripper_joints[::-1]
    assert fingers(arm.robot, outermost_first) == ((0, 1), (2, 3), (4, 5))
    assert fingers(arm.robot, (outermost_first[0], outermost_first[2], outermost_first[1])) == ((0, 2), (1,))
    assert moved_links(panda.robot, ("panda_finger_joint1",)) >= {"panda_leftfinger", "panda_rightfinger"}


def test_mimics_follow_and_references_move_at_one_speed(bench: Make) -> None:
    panda = bench("panda")
    q = np.zeros((2, len(panda.robot.joint_names)))
    i, j = panda.robot.indices(("panda_finger_joint1", "panda_finger_joint2"))
    q[:, i] = 0.01, 0.02
    assert with_mimics(panda.robot, q)[:, j].tolist() == [0.01, 0.02]
    way = ramp(np.array([0.0, 0.0]), np.array([0.2, -1.0]), np.array([0.0, 0.1, 0.5, 2.0]))
    np.testing.assert_allclose(way, [[0, 0], [0.1, -0.1], [0.2, -0.5], [0.2, -1.0]])


def test_a_robot_that_begins_in_something_is_told_so(bench: Make) -> None:
    """A box of 20 cm about the origin of the tool."""
    x, y, z = bench().planner.tool_pose(bench().start).p
    at = f"[{x:.4f}, {y:.4f}, {z:.4f}]"
    arm = bench(scene=f"{{wall: {{box: {{size: [20 cm, 20 cm, 20 cm]}}, pose: {{xyz: {at}}}, fixed: true}}}}")
    refusal = arm.refused("move", {"to": {"joint_1": 0.3}})
    assert re.match(r"'robot/\w+' and 'wall' overlap by [\d.]+ mm at t = 0.00 s of 'move'$", refusal.cause)
    assert refusal.hint is not None and "`start: POSE`" in refusal.hint


def test_a_later_step_that_begins_in_something_is_told_what_lets_it_leave(bench: Make) -> None:
    """A hand that pressed on the desk; `start` and `mount` change nothing there."""
    arm = bench()
    above = {"xyz": [0.7, -0.2, 0.54], "rpy": [0, "90 deg", 0]}
    arm.do("move", {"pose": above})
    arm.do("move", {"pose": {**above, "xyz": [0.7, -0.2, 0.43]}, "path": "linear", "touch": ["desk"]})
    refusal = arm.refused("move", {"pose": above})
    assert "'desk' and 'robot/" in refusal.cause
    assert "before the motion" in refusal.cause
    assert refusal.hint == "add `touch: [desk]` to the `move` that leaves it"
    arm.do("move", {"pose": above, "path": "linear", "touch": ["desk"]})


def test_a_hand_that_hits_something_on_its_move_is_told_how_it_may_and_an_arm_is_not(bench: Make) -> None:
    arm = bench()
    above = {"xyz": [0.7, -0.2, 0.54], "rpy": [0, "90 deg", 0]}
    arm.do("move", {"pose": above})
    hint = arm.refused("move", {"pose": {**above, "xyz": [0.7, -0.2, 0.43]}, "path": "linear"}).hint or ""
    assert hint.endswith("; or add `touch: [desk]`, if the hand is to push it or press on it")
    arm.now = replace(arm.now, carried=Carried("cup", "palm", Transform.identity()))
    held = CollisionHit("cup", "desk", -0.002, time=0.3)
    assert "`touch: [desk]`" in (arm.planner.refusal(arm.now, held, "comes", "", move=True).hint or "")
    for move, link in ((False, "palm"), (True, "link_3")):
        hit = CollisionHit("desk", f"robot/{link}", -0.002, time=0.3)
        assert "touch" not in (arm.planner.refusal(arm.now, hit, "comes", "", move=move).hint or "")


def test_links_that_are_apart_but_nearer_than_the_clearance_are_told_of_the_clearance(bench: Make) -> None:
    """Rounded down, so that what the hint says is kept."""
    arm = bench()
    hit = CollisionHit("robot/link_7", "robot/palm", 0.00239)
    for now in (arm.start, arm.start.moved(arm.start.position)):
        hint = arm.planner.refusal(now, hit, "is", "before the motion").hint or ""
        assert "`clearance: {pairs: [{between: [robot/link_7, robot/palm], distance: ...}]}`" in hint
        assert "up to 2.3 mm" in hint
        assert "`collision_ignore`" not in hint


def test_links_that_overlap_are_told_of_the_robot_file(bench: Make) -> None:
    """Wherever it is: no other start or mount takes them apart."""
    arm = bench()
    hit = CollisionHit("robot/link_7", "robot/palm", -0.002)
    for now in (arm.start, arm.start.moved(arm.start.position)):
        hint = arm.planner.refusal(now, hit, "is", "before the motion").hint or ""
        assert "`collision_ignore`" in hint
        assert "`attach`" in hint
        assert "`start: POSE`" not in hint
