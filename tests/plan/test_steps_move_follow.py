"""`move`, `follow`, `grasp`, `release` and `wait`."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from manipcli.core.errors import NotPlannable
from manipcli.model.collision import CollisionHit
from manipcli.plan.candidates import Attempts
from manipcli.plan.hand import pressing
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.steps import STEPS
from manipcli.plan.steps.follow import FollowSpec
from manipcli.plan.steps.move import MoveSpec

Make = Callable[..., Any]  # fixtures of conftest.py: a Bench of a robot and a scene; steps already planned on one
Story = Any

ARM = [f"joint_{k}" for k in range(1, 8)]
AHEAD = {"rpy": [0, "90 deg", 0]}  # the tool's z along x


def goes_to(arm: Any, spec: dict[str, Any]) -> np.ndarray:
    """X_WT (4, 4) after a move."""
    return arm.tool(arm.plan("move", spec).end.position)


def test_a_named_pose_is_reached_with_arm_and_hand(bench: Make) -> None:
    arm = bench()
    plan = arm.do("move", {"to": "wrap"})
    assert plan.motions[0].trajectory is None
    assert plan.duration == pytest.approx(max(arm.robot.pose("wrap").positions) / arm.planner.gripper_speed)
    plan = arm.do("move", {"to": "zero"})
    np.testing.assert_allclose(plan.end.position, 0.0, atol=1e-12)
    assert plan.motions[0].trajectory is not None
    assert plan.motions[0].grip is not None


def test_joints_by_name_move_and_the_others_stay(bench: Make) -> None:
    arm = bench()
    plan = arm.plan("move", {"to": {"joint_2": "20 deg", "joint_6": -0.5}})
    expected = np.array(arm.now.position)
    expected[arm.robot.indices(("joint_2", "joint_6"))] = np.radians(20), -0.5
    np.testing.assert_allclose(plan.end.position, expected, atol=1e-12)


def test_a_pose_is_meant_in_its_frame(bench: Make) -> None:
    """World, a body that stands at (0.75, 0, 0.4), a frame fixed in that body, and the tool itself."""
    arm = bench(more="frames: {above: {parent: cup, pose: {xyz: [0, 0, 0.3], rpy: [0, 0, 90 deg]}}}")
    R = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    X = goes_to(arm, {"pose": {"xyz": [0.6, 0.1, 0.7], **AHEAD}})
    np.testing.assert_allclose(X[:3, 3], [0.6, 0.1, 0.7], atol=2e-5)
    np.testing.assert_allclose(X[:3, :3], R, atol=2e-4)
    X = goes_to(arm, {"pose": {"xyz": [-0.1, 0, 0.35], **AHEAD}, "frame": "cup"})
    np.testing.assert_allclose(X[:3, 3], [0.65, 0.0, 0.75], atol=2e-5)
    X = goes_to(arm, {"pose": {"xyz": [0.05, 0.1, 0], "rpy": ["90 deg", 0, "-90 deg"]}, "frame": "above"})
    np.testing.assert_allclose(X[:3, 3], [0.75 - 0.1, 0.05, 0.7], atol=2e-5)  # turned by 90 deg about z
    turned = Rotation.from_euler("z", 90, degrees=True) * Rotation.from_euler("xyz", [90, 0, -90], degrees=True)
    np.testing.assert_allclose(X[:3, :3], turned.as_matrix(), atol=2e-4)
    here = arm.tool(arm.now.position)
    X = goes_to(arm, {"pose": {"xyz": [0, 0, -0.05]}, "frame": "tool", "path": "linear"})
    np.testing.assert_allclose(X[:3, 3], here[:3, 3] - 0.05 * here[:3, 2], atol=2e-5)


def test_a_point_and_a_direction_are_meant_in_their_frame_and_nothing_else_counts(bench: Make) -> None:
    arm = bench(more="frames: {above: {parent: cup, pose: {xyz: [0, 0, 0.3], rpy: [0, 0, 90 deg]}}}")
    X = goes_to(arm, {"point": [-0.1, 0, 0.35], "frame": "cup"})
    np.testing.assert_allclose(X[:3, 3], [0.65, 0.0, 0.75], atol=2e-5)
    X = goes_to(arm, {"point": [0.05, 0.1, 0], "pointing": [0, -2, 0], "frame": "above"})
    np.testing.assert_allclose(X[:3, 3], [0.75 - 0.1, 0.05, 0.7], atol=2e-5)
    np.testing.assert_allclose(X[:3, 2], [1, 0, 0], atol=2e-4)  # turned by 90 deg about z
    here = arm.tool(arm.now.position)
    X = goes_to(arm, {"point": [0, 0, 0], "pointing": [0, 0, 1], "frame": "tool"})
    np.testing.assert_allclose(X, here, atol=1e-9)


def test_a_point_is_reached_from_the_nearest_posture(bench: Make) -> None:
    """The same way that a pose of the same place takes, or a shorter one."""
    arm = bench()
    pose, point = ({"xyz": [0.6, 0.1, 0.7], **AHEAD}, [0.6, 0.1, 0.7])
    there, nearest = (
        arm.plan("move", {word: value}).end.position for word, value in (("pose", pose), ("point", point))
    )
    here = arm.now.position
    assert np.linalg.norm(nearest - here) <= np.linalg.norm(there - here)


@pytest.mark.parametrize("pointing", [None, [0.2, 0, 1]])
def test_a_line_to_a_point_is_straight_and_turns_to_where_it_points(bench: Make, pointing: list[float] | None) -> None:
    arm = bench()
    before = arm.now
    spec = {"point": [0, 0.15, -0.1], "frame": "tool", "path": "linear"} | ({"pointing": pointing} if pointing else {})
    X = arm.tools(before, arm.plan("move", spec), "move")
    p = X[:, :3, 3]
    goal = arm.tool(before.position) @ np.array([0, 0.15, -0.1, 1.0])
    np.testing.assert_allclose(p[-1], goal[:3], atol=2e-5)
    along = (p[-1] - p[0]) / np.linalg.norm(p[-1] - p[0])
    assert np.linalg.norm((p - p[0]) - np.outer((p - p[0]) @ along, along), axis=1).max() < 1e-4
    if pointing:
        z = arm.tool(before.position)[:3, :3] @ np.array(pointing) / np.linalg.norm(pointing)
        np.testing.assert_allclose(X[-1, :3, 2], z, atol=2e-4)
        turned = np.arccos(np.clip(X[:, :3, 2] @ z, -1.0, 1.0))
        assert (np.diff(turned) < 1e-4).all()


def test_base_is_where_the_robot_is_mounted(bench: Make) -> None:
    arm = bench()
    X_base = goes_to(arm, {"pose": {"xyz": [0.6, 0.1, 0.7], **AHEAD}, "frame": "base"})
    mounted = arm.robot.X_WB.matrix @ np.array([0.6, 0.1, 0.7, 1.0])
    np.testing.assert_allclose(X_base[:3, 3], mounted[:3], atol=2e-5)


def test_a_frame_goes_with_what_was_moved(bench: Make, story: Story) -> None:
    arm = bench()
    arm.now = story.steps["lift"][1].end
    assert arm.body("cup").p[2] == pytest.approx(0.54, abs=1e-4)
    X_WT = arm.tool(arm.now.position)
    X_OT = np.linalg.inv(arm.body("cup").matrix) @ X_WT
    pose = {"xyz": (X_OT[:3, 3] + [0, 0, 0.05]).tolist(), "quat_xyzw": Rotation.from_matrix(X_OT[:3, :3]).as_quat()}
    pose["quat_xyzw"] = pose["quat_xyzw"].tolist()
    X = goes_to(arm, {"pose": pose, "frame": "cup", "path": "linear"})
    np.testing.assert_allclose(X[:3, 3] - X_WT[:3, 3], [0, 0, 0.05], atol=3e-5)


def test_linear_is_straight_in_space_and_joint_in_the_joints(bench: Make) -> None:
    arm = bench()
    pose = {"pose": {"xyz": [0, 0.15, -0.1], "rpy": [0, 0.2, 0]}, "frame": "tool"}
    before = arm.now
    linear = arm.plan("move", {**pose, "path": "linear"})
    p = arm.tools(before, linear, "move")[:, :3, 3]
    along = (p[-1] - p[0]) / np.linalg.norm(p[-1] - p[0])
    assert np.linalg.norm((p - p[0]) - np.outer((p - p[0]) @ along, along), axis=1).max() < 1e-4
    joint = arm.plan("move", {**pose, "path": "joint"})
    q = joint.motions[0].trajectory.positions
    way = (q[-1] - q[0]) / np.linalg.norm(q[-1] - q[0])
    assert np.linalg.norm((q - q[0]) - np.outer((q - q[0]) @ way, way), axis=1).max() < 1e-9
    np.testing.assert_allclose(arm.tool(joint.end.position), arm.tool(linear.end.position), atol=3e-4)
    p = arm.tools(before, joint, "move")[:, :3, 3]
    assert np.linalg.norm((p - p[0]) - np.outer((p - p[0]) @ along, along), axis=1).max() > 1e-3


def test_a_tool_pose_has_several_configurations_of_the_arm(bench: Make) -> None:
    """All have the tool at the pose, and differ by more than 0.3 rad in some joint; the first is that of the plan."""
    arm = bench("panda")
    step = STEPS["move"]
    spec = step.spec.model_validate({"pose": {"xyz": [0.45, 0.1, 0.5], "rpy": ["180 deg", 0, 0]}})
    attempts = Attempts(step.candidates(spec, arm.planner, arm.now))
    found = []
    with pytest.raises(NotPlannable):
        while True:
            found.append(attempts.take().plan.end.position)
    assert 2 <= len(found) <= 4
    for q in found:
        np.testing.assert_allclose(arm.tool(q)[:3, 3], [0.45, 0.1, 0.5], atol=2e-5)
    assert all(np.abs(a - b).max() > 0.3 for a, b in itertools.combinations(found, 2))


def test_half_speed_halves_velocity_and_acceleration(bench: Make) -> None:
    arm = bench()
    fast, slow = (arm.plan("move", {"to": "zero", "velocity_scaling": s}).motions[0].trajectory for s in (1.0, 0.5))
    assert np.abs(slow.velocities).max() <= 0.5 * max(arm.robot.joint(name).limits.velocity for name in ARM)
    for name, a in zip(slow.names, np.abs(slow.accelerations).max(axis=0), strict=True):
        assert a <= 0.5 * arm.robot.joint(name).limits.acceleration * 1.005
    assert slow.duration > 1.2 * fast.duration


def test_what_a_move_touches_is_pushed_and_else_an_obstacle(bench: Make) -> None:
    """A cube of 8 cm, met at y = -0.14 by a closed hand whose fingers reach to 1 cm on either side of its tool."""
    scene = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
    scene += "  cube: {box: {size: [8 cm, 8 cm, 8 cm]}, mass: 0.2, rests_on: table, at: [0.5, -0.1]}\n"
    arm = bench("panda", scene=scene)

    def to(y: float, **more: object) -> dict[str, object]:
        pose = {"xyz": [0.5, y, 0.25], "rpy": [np.pi, 0, np.pi / 2]}
        return {"pose": pose, "path": "linear", **more}

    def cube() -> np.ndarray:
        return np.array(arm.planner.body_pose(arm.now, "cube").p)

    arm.do("grasp", {"until": "posture"})
    arm.do("move", {**to(-0.24), "path": "free"})
    assert "'cube'" in arm.refused("move", to(0.0)).cause
    arm.do("move", to(0.0, touch=["cube"]))
    pushed = cube()
    np.testing.assert_allclose(pushed, [0.5, 0.05, 0.24], atol=0.006)
    assert "'cube'" in arm.refused("move", {"to": "home"}).cause  # it still leans on it
    arm.do("move", to(-0.05, touch=["cube"]))
    np.testing.assert_array_equal(cube(), pushed)
    arm.do("move", {"to": "home"})


def test_a_guarded_move_is_predicted_to_stop_where_it_meets_what_it_may_touch(bench: Make) -> None:
    """What is held above a table comes to stand on it, within the step of the looks, though the way leads into it; the
    trajectory goes all the way. Away from there it meets nothing, and ends at its end."""
    arm = bench("panda")
    arm.do("pick", {"object": "block", "approach": {"from": "top"}})
    arm.do("lift", {"object": "block", "by": "10 cm"})
    held = arm.now
    into = {"pose": {"xyz": [0, 0, "15 cm"]}, "frame": "tool", "path": "linear", "touch": ["table"], "guarded": True}
    plan = arm.do("move", into)
    (motion,) = plan.motions
    assert (motion.guarded, motion.awaits) == (True, True)
    assert motion.trajectory is not None
    columns = arm.robot.indices(motion.trajectory.names)
    end = np.array(held.position)
    end[columns] = motion.trajectory.positions[-1]
    assert arm.tool(held.position)[2, 3] - arm.tool(end)[2, 3] == pytest.approx(0.15, abs=1e-4)
    gap = arm.body("block").p[2] - 0.025 - 0.2  # its middle, half its height, the table's top
    assert -0.001 <= gap < 0.005
    assert arm.now.carried == held.carried
    fingers = {"panda_joint1": 0.3, "panda_finger_joint1": 0.01}
    there = [bench("panda").plan("move", {"to": fingers, "touch": ["block"], "guarded": one}) for one in (True, False)]
    np.testing.assert_array_equal(there[0].end.position, there[1].end.position)
    np.testing.assert_array_equal(arm.now.position[~np.isin(np.arange(len(end)), columns)], np.delete(end, columns))
    up = arm.do("move", {**into, "pose": {"xyz": [0, 0, "-10 cm"]}})
    np.testing.assert_allclose(up.end.position[columns], up.motions[0].trajectory.positions[-1], atol=1e-12)


def test_what_lies_in_a_pushed_container_goes_with_it(bench: Make) -> None:
    scene = "\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
    scene += "  tray: {tray: {size: [8 cm, 8 cm, 8 cm]}, mass: 0.2, rests_on: table, at: [0.5, -0.1]}\n"
    scene += "  ball: {sphere: {radius: 1 cm}, mass: 10 g, inside: tray}\n"
    scene += "  other: {sphere: {radius: 1 cm}, mass: 10 g, rests_on: table, at: [0.4, -0.1]}\n"
    arm = bench("panda", scene=scene)
    arm.do("grasp", {"until": "posture"})
    for y, more in ((-0.24, {}), (0.0, {"path": "linear", "touch": ["tray"]})):
        arm.do("move", {"pose": {"xyz": [0.5, y, 0.25], "rpy": [np.pi, 0, np.pi / 2]}, **more})
    before = dict(zip((body.name for body in arm.scene.movable), arm.start.bodies, strict=True))
    slid = {name: arm.body(name).p - X_WO.p for name, X_WO in before.items()}
    assert slid["tray"][1] > 0.14
    np.testing.assert_allclose(slid["ball"], slid["tray"], atol=1e-12)
    np.testing.assert_array_equal(slid["other"], np.zeros(3))


def test_a_soft_limit_is_planned_for(bench: Make) -> None:
    """The Panda's description says 2.9671 rad, and of its safety_controller 2.8973: from beyond it is led back."""
    refusal = bench("panda").refused("move", {"to": {"panda_joint1": 2.95}})
    assert refusal.cause == "joint 'panda_joint1' goes to 2.9500 rad, beyond its soft upper limit 2.8973 rad"
    assert refusal.hint is not None
    assert "soft_upper" in refusal.hint
    limits = MotionLimits.of(bench("panda").robot, ("panda_joint1", "panda_finger_joint1"))
    assert limits.soft == {("panda_joint1", 0), ("panda_joint1", 1)}


@pytest.mark.slow
def test_a_move_past_a_limit_names_joint_value_and_limit(bench: Make) -> None:
    refusal = bench().refused("move", {"to": {"joint_4": 3.0}})
    upper = bench().robot.joint("joint_4").limits.upper
    assert refusal.cause == f"joint 'joint_4' goes to 3.0000 rad, beyond its upper limit {upper:.4f} rad"
    assert refusal.loc == ("to", "joint_4")
    assert refusal.hint is None
    assert bench().refused("move", {"to": {"joint_4": -90.0}}).hint == "in degrees? write '-90 deg'"


def test_a_pose_out_of_reach_says_how_far_off_it_stays(bench: Make) -> None:
    refusal = bench().refused("move", {"pose": {"xyz": [2, 0, 0.5]}})
    assert refusal.cause.startswith("no joint positions reach (2.000, 0.000, 0.500) m, 2.0")
    assert refusal.hint is not None


def test_a_move_into_the_desk_is_refused_with_pair_time_and_motion(bench: Make) -> None:
    """Free moves end where nothing touches, or say that there is no such end; joints by name are taken as they are."""
    arm = bench()
    refusal = arm.refused("move", {"to": {"joint_2": 1.6, "joint_4": -0.2}})
    assert "comes within 4 mm of" in refusal.cause
    assert "'desk'" in refusal.cause or "'cup'" in refusal.cause
    assert "s of 'move'" in refusal.cause
    cause = arm.refused("move", {"pose": {"xyz": [0.7, -0.2, 0.43], **AHEAD}}).cause
    assert cause.startswith("the arm reaches (0.700, -0.200, 0.430) m only where desk and robot/")


def test_what_is_too_near_is_told_with_the_clearance_that_is_kept(bench: Make) -> None:
    planner = bench().planner
    too_near, overlap = CollisionHit("cup", "robot/palm", 0.0039), CollisionHit("floor", "robot/base", -0.005)
    told = "cup comes within 4 mm of robot/palm (3.9 mm apart)"
    assert str(planner.in_the_way(too_near)) == told
    assert str(planner.in_the_way(overlap)) == "floor and robot/base overlap by 5.0 mm"
    assert str(planner.in_the_way(CollisionHit("desk", "robot/palm", -1e-5))) == "desk and robot/palm touch"
    just = planner.refusal(bench().now, CollisionHit("desk", "robot/palm", -1e-5), "is", "before it moves")
    assert just.cause == "'desk' and 'robot/palm' overlap by less than 0.1 mm before it moves"
    refusal = planner.refusal(bench().now, overlap, "is", "before it moves")
    assert "`mount` in the robot file" in (refusal.hint or "")
    for hit, own in ((CollisionHit("robot/a", "robot/b", -0.001, time=0.2), True), (too_near, False)):
        refusal = planner.refusal(bench().now, hit, "comes", "at t = 0.20 s of 'move'")
        assert ("`collision_ignore`" in (refusal.hint or "")) == own


def test_moving_while_holding_keeps_holding(bench: Make, story: Story) -> None:
    """`home` says that the hand is open; the cup stays in it."""
    arm = bench()
    arm.now = story.steps["lift"][1].end
    plan = arm.do("move", {"to": "home"})
    assert [motion.grip for motion in plan.motions] == [None]
    assert plan.end.carried is not None
    hand = arm.robot.indices(arm.planner.gripper_joints)
    np.testing.assert_array_equal(plan.end.position[hand], story.steps["lift"][1].end.position[hand])
    X_TO = np.linalg.inv(arm.tool(arm.now.position)) @ arm.body("cup").matrix
    lifted = story.steps["lift"][1].end
    np.testing.assert_allclose(
        X_TO, np.linalg.inv(arm.tool(lifted.position)) @ arm.body("cup", lifted).matrix, atol=1e-9
    )


def test_a_holding_hand_is_not_moved_by_name(bench: Make, story: Story) -> None:
    arm = bench()
    arm.now = story.steps["lift"][1].end
    for target in ("open", {"finger_1_proximal": 0.1}, {"joint_1": 0.1, "finger_1_proximal": 0.1}):
        refusal = arm.refused("move", {"to": target})
        assert refusal.cause == "joint 'finger_1_proximal' belongs to the hand, which holds 'cup'"
        assert refusal.hint == "open the hand with `release` or `place`"


def test_what_stands_must_be_lifted_before_it_is_moved(bench: Make, story: Story) -> None:
    arm = bench()
    arm.now = story.steps["pick"][1].end
    refusal = arm.refused("move", {"to": "home"})
    assert refusal.cause.startswith("'cup' still touches 'desk'")
    assert refusal.hint == "`lift` 'cup' first"


def test_a_move_says_one_target(bench: Make) -> None:
    spec = STEPS["move"].spec
    home = {"to": "home"}
    for wrong in ({}, {**home, "pose": {}}, {"to": {}}, {**home, "path": "linear"}, {**home, "velocity_scaling": 0}):
        with pytest.raises(ValidationError):
            spec.model_validate(wrong)
    arm = bench()
    assert arm.problems("move", {"to": "hom"}) == [
        (("to",), "robot 'arm7_hand3' has no pose 'hom'", "did you mean 'home'?")
    ]
    assert arm.problems("move", {"to": {"joint_9": 0}})[0][0] == ("to", "joint_9")
    assert arm.problems("move", {"pose": {}, "frame": "trey"}) == [
        (("frame",), "unknown frame 'trey'", "did you mean 'tray'?")
    ]


def follow(*points: dict[str, Any], joints: tuple[str, ...] = ("joint_1", "joint_2")) -> dict[str, Any]:
    return {"joint_names": list(joints), "points": list(points)}


def test_positions_alone_are_followed_on_straight_lines(bench: Make) -> None:
    arm = bench()
    spec = follow(
        {"positions": [0.4, 0.1], "time_from_start": 1.0}, {"positions": [0.4, 0.3], "time_from_start": "1500 ms"}
    )
    trajectory = arm.plan("follow", spec).motions[0].trajectory
    for t, q in ((0.25, [0.1, 0.1]), (1.0, [0.4, 0.1]), (1.25, [0.4, 0.2]), (1.5, [0.4, 0.3])):
        np.testing.assert_allclose(trajectory.sample(t)[0], q, atol=1e-9)
    assert trajectory.velocities is None  # a controller would take those of its end as what is wanted there
    assert trajectory.sample(1.5)[1].tolist() == [0.0, 0.0]


def test_velocities_make_cubics_and_accelerations_quintics(bench: Make) -> None:
    """From rest to rest over D in T: 3 s^2 - 2 s^3, and 10 s^3 - 15 s^4 + 6 s^5."""
    arm = bench()
    s = np.linspace(0.0, 1.0, 11)
    for extra, curve in (
        ({"velocities": [0, 0]}, 3 * s**2 - 2 * s**3),
        ({"velocities": [0, 0], "accelerations": [0, 0]}, 10 * s**3 - 15 * s**4 + 6 * s**5),
    ):
        spec = follow({"positions": [0.5, 0.1], **extra, "time_from_start": 2})
        q = arm.plan("follow", spec).motions[0].trajectory.sample(2.0 * s)[0]
        np.testing.assert_allclose(q[:, 0], 0.5 * curve, atol=1e-9)


def test_each_segment_is_what_both_its_points_give(bench: Make) -> None:
    """A point with a velocity, then one without: a cubic that leads to it, and a straight line after it."""
    arm = bench()
    spec = follow(
        {"positions": [0.2, 0.1], "velocities": [0, 0], "time_from_start": 1},
        {"positions": [0.4, 0.1], "time_from_start": 2},
    )
    q = arm.plan("follow", spec).motions[0].trajectory.sample(np.array([0.25, 1.5]))[0]
    np.testing.assert_allclose(q[:, 0], [0.2 * (3 / 16 - 2 / 64), 0.3], atol=1e-9)


def test_times_are_said_in_the_words_of_both_ros(bench: Make) -> None:
    arm = bench()
    for time in ({"secs": 1, "nsecs": 250000000}, {"sec": 1, "nanosec": 250000000}, 1.25, "1.25 s"):
        spec = follow({"positions": [0.1, 0.1], "velocities": [0, 0], "time_from_start": time})
        assert arm.plan("follow", spec).duration == pytest.approx(1.25)


@pytest.mark.parametrize(
    ("time", "told"),
    [
        ({"secs": 1, "sec": 2}, "'secs' is a field of ROS 1, 'sec' a field of ROS 2"),
        ({"secs": 1, "nanosec": 2}, "'secs' is a field of ROS 1, 'nanosec' a field of ROS 2"),
        ({"secs": 1, "nsecs": 1_000_000_000}, "less than 1000000000"),
        ({"sec": 1, "nanosec": 3_000_000_000}, "less than 1000000000"),
    ],
)
def test_a_time_that_has_two_meanings_is_refused(time: dict[str, int], told: str) -> None:
    with pytest.raises(ValidationError, match=told):
        FollowSpec.model_validate(follow({"positions": [0.1, 0.2], "time_from_start": time}))


def test_what_is_written_out_with_all_defaults_reads_back() -> None:
    point = {"positions": [0.1, 0.2], "time_from_start": {"sec": 1, "nanosec": 999_999_999}}
    spec = FollowSpec.model_validate(follow(point))
    assert FollowSpec.model_validate(spec.model_dump()).points[0].seconds == pytest.approx(2.0)
    moved = MoveSpec(to="home")
    assert MoveSpec.model_validate(moved.model_dump()) == moved


@pytest.mark.parametrize("to", ["home", {"a": 0.1}])
def test_what_is_said_of_joints_has_no_frame(to: str | dict[str, float]) -> None:
    with pytest.raises(ValidationError, match="`frame` applies to a tool `pose` or `point`"):
        MoveSpec(to=to, frame="desk")


def test_a_time_between_two_ticks_ends_on_the_last_point(bench: Make) -> None:
    spec = follow({"positions": [0.1, 0.2], "velocities": [0, 0], "time_from_start": 1.00037})
    plan = bench().plan("follow", spec)
    assert plan.duration == pytest.approx(1.00037)
    np.testing.assert_allclose(plan.motions[0].trajectory.positions[-1], [0.1, 0.2], atol=1e-12)
    np.testing.assert_allclose(plan.end.position[:2], [0.1, 0.2], atol=1e-12)


def test_a_first_point_at_0_s_is_where_the_robot_is(bench: Make) -> None:
    arm = bench()
    end = {"positions": [0.2, 0.1], "velocities": [0, 0], "time_from_start": 2}
    here = {"positions": [0.0, 0.1], "velocities": [0, 0], "time_from_start": 0}
    plan = arm.plan("follow", follow(here, end))
    np.testing.assert_array_equal(plan.motions[0].trajectory.positions[0], arm.now.position[:2])
    refusal = arm.refused("follow", follow({**here, "positions": [0.3, 0.1]}, end))
    assert refusal.cause == "the first point, at 0 s, has joint 'joint_1' at 0.3000 rad, but the joint is at 0.0000 rad"


def test_points_beyond_a_limit_name_joint_value_limit_and_time(bench: Make) -> None:
    """A cubic over D in T has its greatest velocity 1.5 D / T in the middle, its acceleration 6 D / T^2 at the ends."""
    arm = bench()
    v, a = arm.robot.joint("joint_1").limits.velocity, arm.robot.joint("joint_1").limits.acceleration
    still = {"velocities": [0, 0]}
    way = v / 1.5 * 1.1
    cause = arm.refused("follow", follow({"positions": [way, 0.1], **still, "time_from_start": 1})).cause
    assert cause.startswith(f"joint 'joint_1' needs velocity {1.1 * v:.4g} rad/s at t = 0.")
    assert cause.endswith(f"its limit is {v:.4g} rad/s")
    way = a / 6 * 0.25 * 1.1
    refusal = arm.refused("follow", follow({"positions": [way, 0.1], **still, "time_from_start": 0.5}))
    assert "joint 'joint_1' needs acceleration" in refusal.cause
    assert "by a factor of 1.05:" in (refusal.hint or "")
    arm.plan("follow", follow({"positions": [way, 0.1], **still, "time_from_start": 1.05 * 0.5}))
    cause = arm.refused("follow", follow({"positions": [0, 9.0], **still, "time_from_start": 60})).cause
    assert "joint 'joint_2' goes to 9.0000 rad at t = 60.000 s, beyond its upper limit" in cause


@pytest.mark.parametrize("words", [(), ("velocities",), ("velocities", "accelerations")])
def test_points_that_are_slowed_down_to_the_letter_of_the_hint_keep_the_limits(
    bench: Make, words: tuple[str, ...]
) -> None:
    arm = bench()
    limits = arm.robot.joint("joint_1").limits
    fast = {
        (): {"positions": [1.6 * limits.velocity, 0.1], "time_from_start": 1.0},
        ("velocities",): {"positions": [0.3, 0.1], "velocities": [3.0 * limits.velocity, 0], "time_from_start": 1.0},
        ("velocities", "accelerations"): {
            "positions": [0.3, 0.1],
            "velocities": [0.3, 0],
            "accelerations": [1.5 * limits.acceleration, 0],
            "time_from_start": 1.0,
        },
    }[words]
    last = {"positions": [0.6, 0.1], "time_from_start": 2.0} | {word: [0, 0] for word in words}
    hint = arm.refused("follow", follow(fast, last)).hint or ""
    assert [word for word in ("velocities", "accelerations") if f"`{word}`" in hint] == list(words)
    found = re.fullmatch(
        r"slow the trajectory down by a factor of (\S+): multiply every `time_from_start` by it"
        r"(, divide `velocities` by it(, divide `accelerations` by its square)?)?",
        hint,
    )
    assert found is not None
    longer = float(found[1])
    power = {"positions": 0, "velocities": -1, "accelerations": -2}
    slow = [
        {
            word: value * longer if isinstance(value, float) else [longer ** power[word] * one for one in value]
            for word, value in point.items()
        }
        for point in (fast, last)
    ]
    assert arm.plan("follow", follow(*slow)).duration == pytest.approx(2.0 * longer)


def test_points_that_make_no_trajectory_are_refused_where_they_are_read() -> None:
    spec = STEPS["follow"].spec
    good = {"positions": [0.1, 0.1], "time_from_start": 1}
    for wrong, text in (
        (follow({**good, "positions": [0.1]}), "1 positions for 2 joints"),
        (follow({**good, "velocities": [0.1]}), "1 velocities for 2 joints"),
        (follow({**good, "velocities": [0.0, 0.1]}), "must be at rest; its velocity of joint_2 is not 0"),
        (follow({**good, "accelerations": [0, 0]}), "accelerations need velocities"),
        (follow(good, good), "1 s is not after 1 s"),
        (follow({**good, "time_from_start": 0}), "the trajectory has no duration"),
        (follow(good, joints=("joint_1", "joint_1")), "duplicate joint"),
    ):
        with pytest.raises(ValidationError, match=text):
            spec.model_validate(wrong)


def test_a_joint_that_is_not_there_is_named_with_the_nearest(bench: Make) -> None:
    spec = follow({"positions": [0, 0], "time_from_start": 1}, joints=("joint_1", "join_2"))
    assert bench().problems("follow", spec) == [
        (("joint_names", 1), "joint 'join_2' is not a movable joint of robot 'arm7_hand3'", "did you mean 'joint_2'?")
    ]
    mimic = follow({"positions": [0], "time_from_start": 1}, joints=("panda_finger_joint2",))
    assert bench("panda").problems("follow", mimic)[0][2] == "did you mean 'panda_finger_joint1'?"


def test_a_release_lets_go_and_leaves_the_object(bench: Make, story: Story) -> None:
    arm = bench()
    arm.now = story.steps["pick"][1].end
    plan = arm.do("release", {})
    assert plan.end.carried is None
    hand = arm.robot.indices(arm.planner.gripper_joints)
    np.testing.assert_allclose(plan.end.position[hand], 0.0, atol=1e-12)
    np.testing.assert_array_equal(arm.body("cup").matrix, arm.body("cup", story.steps["pick"][1].end).matrix)
    assert plan.duration > 0.05
    assert arm.plan("release", {}).duration == 0.0


def test_a_release_into_a_pose_that_would_still_hold_is_refused(bench: Make, story: Story) -> None:
    arm = bench()
    arm.now = story.steps["pick"][1].end
    refusal = arm.refused("release", {"posture": "wrap"})
    still = r"'robot/finger_\d_\w+' still presses on 'cup' with the hand in its pose 'wrap'"
    assert re.fullmatch(still, refusal.cause)
    assert refusal.hint == "set a pose in which the hand is open: `posture: POSE`"
    assert arm.plan("release", {"posture": "zero"}).end.carried is None


def test_a_finger_alone_does_not_hold(bench: Make, story: Story) -> None:
    """It pushes away what has slipped towards it, as the others open; against a second one it would hold."""
    arm = bench()
    arm.now = story.steps["pick"][1].end
    joints, query = arm.planner.gripper_joints, arm.planner.grasping(arm.now, "cup")
    wrap = arm.robot.pose("wrap").positions[0]

    def pressed_by(closed: list[str]) -> str | None:
        position = np.array(arm.now.position)
        position[arm.robot.indices(joints)] = [wrap * any(name.startswith(one) for one in closed) for name in joints]
        return pressing(arm.robot, query, position, joints)

    for finger in ("finger_1", "finger_2", "finger_3"):
        assert pressed_by([finger]) is None
        others = [other for other in ("finger_1", "finger_2", "finger_3") if other != finger]
        assert re.fullmatch(rf"robot/({'|'.join(others)})_\w+", str(pressed_by(others)))


def test_a_hand_closed_on_nothing_named_is_left_closed_by_moves(bench: Make) -> None:
    arm = bench()
    arm.do("grasp", {"posture": "wrap"})
    assert arm.now.closed
    assert arm.plan("move", {"to": "zero"}).motions[0].grip is None
    refusal = arm.refused("move", {"to": "open"})
    assert refusal.cause.endswith("belongs to the hand, which an earlier step closed")
    assert refusal.hint == "open the hand with `release`"
    assert arm.refused("lift", {"object": "cup"}).cause == "'cup' is not held: the hand is closed, but not on it"
    arm.do("release", {})
    assert not arm.now.closed


def test_wait_is_one_number_or_a_mapping(bench: Make) -> None:
    arm = bench()
    for spec in (1.5, "1.5 s", "1500 ms", {"duration": 1.5}):
        plan = arm.plan("wait", spec)
        assert plan.duration == 1.5
        assert plan.end == arm.now
        assert [(m.trajectory, m.grip, m.awaits) for m in plan.motions] == [(None, None, True)]
    with pytest.raises(ValidationError):
        STEPS["wait"].spec.model_validate(-1)


def test_free_takes_another_posture_where_the_way_to_the_nearest_is_not_free(bench: Make) -> None:
    """Down to 10 cm over the desk: straight in joint space the fingers would brush it on the way."""
    arm = bench()
    pose = {"xyz": [0.55, 0.05, 0.5], "rpy": ["180 deg", 0, 0]}
    refusal = arm.refused("move", {"pose": pose, "path": "joint"})
    assert "'desk' comes within 4 mm of 'robot/finger" in refusal.cause
    X = goes_to(arm, {"pose": pose, "path": "free"})
    np.testing.assert_allclose(X[:3, 3], [0.55, 0.05, 0.5], atol=2e-5)
