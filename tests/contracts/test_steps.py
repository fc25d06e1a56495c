"""What every step promises of its plan; a step that joins the registry joins these tests with a line in `CASES`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.control.controllers.gripper import GripperSpec
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.plan.hand import closing_speed
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.planner import Planner
from manipcli.plan.steps import STEPS
from manipcli.task.camera_sights import camera_sights
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
PICK = ("pick", {"object": "cup", "grasp": {"posture": "wrap", "height": "68 mm"}})
LIFT = ("lift", {"object": "cup"})
POINTS = [
    {"positions": [0.2, 0.2], "velocities": [0.1, 0], "accelerations": [0, 0], "time_from_start": 1.0},
    {"positions": [0.3, 0.1], "velocities": [0, 0], "accelerations": [0, 0], "time_from_start": 2.0},
]
CASES: dict[str, tuple[tuple[str, Any], tuple[tuple[str, Any], ...]]] = {
    # the step, and the steps before it
    "move to a named pose": (("move", {"to": "zero"}), ()),
    "move joints": (("move", {"to": {"joint_1": "60 deg", "joint_7": -1.0}}), ()),
    "move the tool": (("move", {"pose": {"xyz": [0, 0.1, -0.1], "rpy": [0, 0.3, 0]}, "frame": "tool"}), ()),
    "move on a line": (
        ("move", {"pose": {"xyz": [0, 0.2, -0.1], "rpy": [0.3, 0, 0]}, "frame": "tool", "path": "linear"}), ()
    ),
    "move on an arc": (
        ("move", {"pose": {"xyz": [0, 0.2, 0.1]}, "frame": "tool", "path": {"arc": {"via": [0, 0.1, 0.12]}}}), ()
    ),
    "move through a point": (
        (
            "move",
            {
                "pose": {"xyz": [0, 0.2, 0.0]}, "frame": "tool",
                "path": {"via": [{"xyz": [0, 0.1, 0.1], "radius": 0.05}]},
            },
        ),
        (),
    ),
    "move to a point": (("move", {"point": [0.6, 0.1, 0.7]}), ()),
    "move to a point on a line, pointing": (
        ("move", {"point": [0, 0.1, -0.1], "pointing": [0.2, 0, 1], "frame": "tool", "path": "linear"}), ()
    ),
    "move what is held": (("move", {"to": "home"}), (PICK, LIFT)),
    "follow": (("follow", {"joint_names": ["joint_1", "joint_2"], "points": POINTS}), ()),
    "follow, retimed": (("follow", {"joint_names": ["joint_1", "joint_2"], "points": POINTS, "retime": True}), ()),
    "grasp": (("grasp", {"posture": "wrap"}), ()),
    "release": (("release", {}), (("grasp", {"posture": "wrap"}),)),
    "wait": (("wait", "1 s"), ()),
    "switch controllers": (("switch_controllers", "hand_controller"), ()),
    "pick": (PICK, ()),
    "lift": (LIFT, (PICK,)),
    "pour": (("pour", {"object": "cup", "into": "tray"}), (PICK, LIFT)),
    "place": (("place", {"object": "cup"}), (PICK, LIFT)),
    "press": (("press", {"object": "desk", "force": "5 N", "at": [-0.2, -0.15, 0.2]}), ()),
    "slide": (("slide", {"object": "desk", "force": "5 N", "along": [[-0.2, -0.15], [-0.2, -0.1]]}), ()),
    "insert": (("insert", {"object": "cup", "into": "tray", "depth": "1 cm", "force": "6 N"}), (PICK, LIFT)),
    "push": (("push", {"object": "cup", "by": "5 cm", "posture": "wrap"}), ()),
    "locate": (("locate", {"object": "cup", "with": "wrist_camera"}), ()),
    "open": (("open", {"object": "dial", "by": "60 deg"}), ()),
    "close": (("close", {"object": "dial"}), (("open", {"object": "dial", "by": "60 deg"}),)),
    "turn": (("turn", {"object": "dial", "by": "90 deg"}), ()),
}  # fmt: skip
SCENES = {"open": "dial", "close": "dial", "turn": "dial"}
"""The task in whose scene a step is planned, by its verb; the others: `pour_seen`."""
TICK = 1e-3
TOLERANCE = 1.005  # of velocity, acceleration and jerk: half a percent

every_case = pytest.mark.parametrize("name", list(CASES))


@dataclass(frozen=True)
class Planned:
    """A case: the step planned from `before`."""

    before: PlanningState
    plan: StepPlan


@cache
def load(verb: str) -> Task:
    return load_task(ROOT / "tasks" / f"{SCENES.get(verb, 'pour_seen')}.yaml")


@pytest.fixture
def task(name: str) -> Task:
    return load(CASES[name][0][0])


def make_planner(task: Task, seed: int = 3) -> Planner:
    (gripper,) = (spec for spec in task.controllers.controllers.values() if isinstance(spec, GripperSpec))
    return Planner(
        task.robot, task.scene, period=TICK, rng=np.random.default_rng(seed),
        gripper_joints=gripper.joints, gripper_speed=closing_speed(task.robot, gripper.joints, gripper.speed),
        sights=camera_sights(task.sensors, task.robot, task.scene),
    )  # fmt: skip


def plan(planner: Planner, step: tuple[str, Any], situation: PlanningState) -> StepPlan:
    verb, spec = step
    return STEPS[verb].plan(STEPS[verb].spec.model_validate(spec), planner, situation)


@pytest.fixture(scope="module")
def planned() -> dict[str, Planned]:
    """Every case, planned once; what leads to it is planned once, too."""
    ends: dict[tuple[int, str], PlanningState] = {}
    found = {}
    for name, (step, lead) in CASES.items():
        task = load(step[0])
        before = PlanningState(start_position(task), tuple(body.X_WO for body in task.scene.movable))
        for k, prior in enumerate(lead):
            done = id(task), str(lead[: k + 1])
            if done not in ends:
                ends[done] = plan(make_planner(task), prior, before).end
            before = ends[done]
        found[name] = Planned(before, plan(make_planner(task), step, before))
    return found


def test_every_step_has_a_case() -> None:
    assert {step[0] for step, _ in CASES.values()} == set(STEPS.names)


@pytest.mark.slow
@every_case
def test_begins_where_the_robot_is_and_goes_on_where_it_got(task: Task, planned: dict[str, Planned], name: str) -> None:
    case = planned[name]
    q = np.array(case.before.position)
    for motion in case.plan.motions:
        if motion.trajectory is not None:
            columns = task.robot.indices(motion.trajectory.names)
            np.testing.assert_allclose(motion.trajectory.positions[0], q[columns], atol=1e-9)
            q[columns] = motion.trajectory.positions[-1]
    arm = [k for k, joint in enumerate(task.robot.joint_names) if "finger" not in joint]
    np.testing.assert_allclose(case.plan.end.position[arm], q[arm], atol=1e-9)


@pytest.mark.slow
@every_case
def test_every_trajectory_rests_at_both_ends(planned: dict[str, Planned], name: str) -> None:
    for motion in planned[name].plan.motions:
        if motion.trajectory is not None:
            assert motion.trajectory.velocities is not None
            np.testing.assert_allclose(motion.trajectory.velocities[[0, -1]], 0.0, atol=1e-9)


@every_case
def test_limits_hold_at_1_khz_by_differences_of_the_samples(task: Task, planned: dict[str, Planned], name: str) -> None:
    """Differences are means over a tick, so a motion within its limits passes; jerk is that of stated accelerations."""
    for motion in planned[name].plan.motions:
        trajectory = motion.trajectory
        if trajectory is None:
            continue
        q, v, a = trajectory.sample(np.arange(round(trajectory.duration / TICK) + 1) * TICK)
        limits = [task.robot.joint(joint).limits for joint in trajectory.names]
        for limit, p in zip(limits, q.T, strict=True):
            assert limit.lower - 1e-9 <= p.min() <= p.max() <= limit.upper + 1e-9

        def within(values: Array, word: str, limits: list[Any] = limits) -> None:
            most = np.array([getattr(limit, word) or np.inf for limit in limits])
            assert (np.abs(values) <= TOLERANCE * most).all(), word

        within(np.diff(q, axis=0) / TICK, "velocity")
        within(np.diff(q, 2, axis=0) / TICK**2, "acceleration")
        within(v, "velocity")
        within(a, "acceleration")
        within(np.diff(v, axis=0) / TICK, "acceleration")
        within(np.diff(a, axis=0) / TICK, "jerk")
        # What is stated is what is done: the feed-forward of the controllers rests on it.
        speed = np.array([limit.velocity for limit in limits])
        assert (np.abs(np.diff(q, axis=0) / TICK - 0.5 * (v[1:] + v[:-1])) < 1e-3 * speed).all()


@every_case
def test_the_same_seed_gives_the_same_plan_and_leaves_what_it_began_in(
    task: Task, planned: dict[str, Planned], name: str
) -> None:
    before, one = planned[name].before, planned[name].plan
    kept = before.position.copy(), [body.matrix.copy() for body in before.bodies]
    two = plan(make_planner(task), CASES[name][0], before)
    assert [motion.label for motion in one.motions] == [motion.label for motion in two.motions]
    for a, b in zip(one.motions, two.motions, strict=True):
        assert a.duration == b.duration
        for x, y in ((a.trajectory, b.trajectory), (a.grip, b.grip)):
            assert (x is None) == (y is None)
        if a.trajectory is not None and b.trajectory is not None:
            np.testing.assert_array_equal(a.trajectory.positions, b.trajectory.positions)
        if a.grip is not None and b.grip is not None:
            np.testing.assert_array_equal(a.grip.target, b.grip.target)
    np.testing.assert_array_equal(one.end.position, two.end.position)
    np.testing.assert_array_equal(before.position, kept[0])
    np.testing.assert_array_equal([Transform.of(xyz=X.p, R=X.R).matrix for X in before.bodies], kept[1])


@every_case
def test_durations_are_those_of_the_trajectories_or_longer(planned: dict[str, Planned], name: str) -> None:
    result = planned[name].plan
    assert len(result.motions) >= 1
    for motion in result.motions:
        assert motion.duration >= (0.0 if motion.trajectory is None else motion.trajectory.duration)
        if motion.trajectory is not None:
            assert all(b > a for a, b in pairwise(motion.trajectory.times))
    assert result.duration == pytest.approx(sum(motion.duration for motion in result.motions))


@every_case
def test_no_way_leads_from_where_something_stands_in_the_arm(
    task: Task, planned: dict[str, Planned], name: str
) -> None:
    """The ball, put into a link of the arm."""
    verb, spec = CASES[name][0]
    before = planned[name].before
    if planned[name].plan.motions[0].trajectory is None:
        pytest.skip("the arm does not move")
    if "ball" not in {body.name for body in task.scene.bodies}:
        pytest.skip("the scene has no loose body")
    planner = make_planner(task)
    X_WL = planner.kinematics.forward(before.position, "link_5")
    blocked = replace(before, bodies=(before.bodies[0], X_WL))
    with pytest.raises(NotPlannable, match=r"'ball' and 'robot/link_[45]' overlap by [\d.]+ mm "):
        plan(planner, (verb, spec), blocked)
