"""Arms of four and five joints pick, carry and place a block: they decide the yaw of the hand, often its pitch."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.configuration import with_mimics
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.pipeline import run_task
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.pose_error import PoseTolerance
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

Write = Callable[..., Path]
FAR = {"at": (0.4, 0.16), "to": (0.32, -0.2)}
"""Out of reach from straight above."""
NEAR = {"at": (0.3, 0.16), "to": (0.25, -0.2)}


@pytest.mark.parametrize(("kind", "places"), [("five", FAR), ("four", FAR), ("palletizer", NEAR), ("scara", NEAR)])
def test_a_block_is_picked_carried_and_placed_in_physics(
    few_joints: Write, kind: str, places: dict[str, tuple[float, float]], tmp_path: Path
) -> None:
    report = run_task(few_joints(kind, **places), log=tmp_path / "run.mcap")
    assert report.verdict.verdict == "passed", report.verdict


@pytest.mark.parametrize("pitch", [20, 60])
def test_the_hand_comes_at_the_stated_pitch_and_holds_the_block_level(few_joints: Write, pitch: int) -> None:
    task = load_task(few_joints("five", at=(0.3, 0.1), to=(0.3, -0.1), approach=f"{{pitch: {pitch} deg}}"))
    pick = plan_task(task).steps[0].plan
    closes, approach = pick.motions[-1], next(motion for motion in pick.motions if motion.label == "approach")
    assert closes.begins is not None and approach.begins is not None
    X_WT = tool(task.robot, closes.begins.position)
    assert np.degrees(np.arcsin(-X_WT.R[2, 2])) == pytest.approx(pitch, abs=0.1)
    assert X_WT.R[2, 1] == pytest.approx(0.0, abs=1e-3)
    before = tool(task.robot, approach.begins.position)
    away = (before.p - X_WT.p) / np.linalg.norm(before.p - X_WT.p)
    assert away @ X_WT.R[:, 2] < -0.49  # straight out of the hand, or up to 60 deg above that


def tool(robot: RobotModel, q: Array) -> Transform:
    """X_WT at the positions (n) of all joints."""
    assert robot.tool is not None
    return Kinematics(robot).forward(q, robot.tool.link) @ robot.tool.X_LT


@pytest.mark.parametrize("kind", ["five", "four"])
def test_no_yaw_reaches_what_the_open_yaw_does_not(few_joints: Write, kind: str) -> None:
    """Brute force: the goal at each of 60 yaws, from random starts, with all of its orientation stated."""
    robot = load_task(few_joints(kind, **FAR)).robot
    solver = arm_solver(robot)
    rng, home = np.random.default_rng(3), np.zeros(len(robot.joint_names))
    counted = []
    for _ in range(12):
        p, pitch = rng.uniform((0.1, -0.3, 0.0), (0.55, 0.3, 0.4)), rng.uniform(0.0, 1.5)
        goals = [Transform.of(xyz=p, rpy=(0.0, np.pi / 2 + pitch, yaw)) for yaw in np.linspace(-np.pi, np.pi, 61)]
        try:
            q = solver.leaving("yaw").solve(goals[0], home, rng)
        except NotPlannable:
            starts = [*solver.random_configurations(home, rng, 2)]
            assert not any(solver.track(goal, start).converged for goal in goals for start in starts)
            counted.append(False)
            continue
        reached = solver.forward(q)
        assert np.linalg.norm(reached.p - p) <= 1e-4
        assert reached.R[2] == pytest.approx(goals[0].R[2], abs=1e-3)  # the same up to a rotation about the vertical
        assert solver.reaches(reached, solver.solve(reached, home, rng))
        counted.append(True)
    assert any(counted) and not all(counted)


@pytest.mark.parametrize(
    ("distance", "rotation", "axis", "within"),
    [
        (0.02, 1e-3, None, 0.0),
        (1e-4, 0.2, None, 0.0),
        (0.01, 0.1, None, 0.0),
        (1e-4, 1e-3, (0.0, 0.0, 1.0), 0.5),
        (5e-3, 0.05, (0.6, 0.0, 0.8), 3.0),
    ],
)
def test_a_goal_beside_a_reachable_pose_is_reached_within_the_tolerance(
    few_joints: Write, distance: float, rotation: float, axis: tuple[float, ...] | None, within: float
) -> None:
    """The goals are poses of the arm, displaced by up to the tolerance: most of them it cannot reach exactly."""
    robot = load_task(few_joints("five", **FAR)).robot
    solver, rng = arm_solver(robot), np.random.default_rng(8)
    about = None if axis is None else np.array(axis)
    tolerant = solver.leaving(PoseTolerance(distance, rotation, "nothing", about, within))
    displaced = 0
    for start in solver.random_configurations(np.zeros(len(robot.joint_names)), rng, 5):
        made, away, turn = solver.forward(start), direction(rng), direction(rng)
        R = Rotation.from_rotvec(0.9 * rotation * turn) * Rotation.from_matrix(made.R)
        if about is not None:
            R = Rotation.from_rotvec(rng.uniform(-0.9, 0.9) * within * about) * R
        goal = Transform.of(xyz=made.p + 0.9 * distance * away, R=R.as_matrix())
        reached = solver.forward(tolerant.solve(goal, np.zeros(len(robot.joint_names)), rng))
        assert np.linalg.norm(reached.p - goal.p) <= distance + 1e-9
        turns = np.linspace(-within, within, 2001)[:, None] * (np.zeros(3) if about is None else about)
        left = Rotation.from_rotvec(turns) * R * Rotation.from_matrix(reached.R).inv()
        assert left.magnitude().min() <= rotation + 2e-3 * (about is not None) + 1e-9
        displaced += not solver.track(goal, start).converged
    assert displaced >= 2


def test_a_tolerance_is_used_by_free_and_linear_moves(few_joints: Write) -> None:
    path = few_joints("five", **NEAR)
    pose = "pose: {xyz: [0.3, 0.1, 0.2], rpy: [0, 120 deg, 0]}"
    vertical = "tolerance: {about: {axis: [0, 0, 1], within: 30 deg}}"
    path.write_text(
        "task: move\nrobot: robot.yaml\ncontrollers: controllers.yaml\nstart: home\nsteps:\n"
        f"  - move: {{{pose}, {vertical}}}\n"
        f"  - move: {{{pose.replace('0.1, 0.2', '0.05, 0.25')}, {vertical}, path: linear}}\n"
        f"  - move: {{{pose}, tolerance: {{distance: 5 cm, rotation: 10 deg}}}}\n"
    )
    task = load_task(path)
    ends = [tool(task.robot, step.plan.end.position) for step in plan_task(task).steps]
    for end, p in zip(ends[:2], [(0.3, 0.1, 0.2), (0.3, 0.05, 0.25)], strict=True):
        np.testing.assert_allclose(end.p, p, atol=1e-4)
        assert np.degrees(np.arcsin(-end.R[2, 2])) == pytest.approx(30.0, abs=0.06)
        assert abs(np.degrees(np.arctan2(end.R[1, 2], end.R[0, 2]))) <= 30.06
    assert np.linalg.norm(ends[2].p - (0.3, 0.1, 0.2)) <= 0.05
    left = Rotation.from_euler("y", 120, degrees=True).inv() * Rotation.from_matrix(ends[2].R)
    assert np.degrees(left.magnitude()) <= 10.0
    path.write_text(path.read_text().replace("within: 30 deg", "within: 5 deg"))
    with pytest.raises(NotPlannable, match="the nearest pose is"):
        plan_task(load_task(path))


def direction(rng: np.random.Generator) -> Array:
    """A random unit vector (3,)."""
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))


def arm_solver(robot: RobotModel) -> InverseKinematics:
    """Inverse kinematics of the tool over the joints of the arm."""
    assert robot.tool is not None
    joints = tuple(name for name in robot.joint_names if name.startswith("joint"))
    return InverseKinematics(Kinematics(robot), joints, robot.tool.link, X_LT=robot.tool.X_LT)


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        (
            "approach: {from: top, yaw: 0}",
            "approach: {from: top, yaw: 0, distance: 40 cm}",
            "shorten `approach: {distance: ...}`: the arm reaches 'block', but not the start at (0.300, 0.160, 0.420)",
        ),
        ("onto: table", "onto: table, clearance: 50 cm", "`clearance: ...`: the arm reaches the place, but not 500 mm"),
        ("onto: table", "onto: table, retreat: 50 cm", "withdraw the hand less, `retreat: ...`"),
    ],
)
def test_hints_name_the_field_and_the_point_that_is_out_of_reach(
    few_joints: Write, old: str, new: str, hint: str
) -> None:
    path = few_joints("five", at=(0.3, 0.16), to=(0.3, 0.1), approach="{from: top, yaw: 0}")
    path.write_text("planner: {samples: 0}\n" + path.read_text().replace(old, new))
    with pytest.raises(NotPlannable) as refused:
        plan_task(load_task(path))
    assert hint in (refused.value.hint or "")


def test_a_pitch_and_a_side_are_not_stated_together(few_joints: Write) -> None:
    with pytest.raises(InvalidInput, match="both set the angle of the approach"):
        load_task(few_joints("five", **NEAR, approach="{from: top, pitch: 30 deg}"))


def test_joints_that_mimic_those_of_the_arm_follow_in_every_solution(few_joints: Write) -> None:
    """The Jacobian is checked by central differences over the leading joints, the mimics at their multiple of these."""
    robot = load_task(few_joints("palletizer", **NEAR)).robot
    leaders = [joint.name for joint in robot.moving_joints if joint.name.startswith("joint") and joint.mimic is None]
    assert robot.tool is not None
    solver = InverseKinematics(Kinematics(robot), leaders, robot.tool.link, X_LT=robot.tool.X_LT)
    goal = Transform.of(xyz=(0.3, 0.1, 0.1), rpy=(np.pi, 0.0, 0.4))
    q = solver.solve(goal, np.zeros(len(robot.joint_names)), np.random.default_rng(2))
    np.testing.assert_array_equal(with_mimics(robot, q), q)
    reached = solver.forward(q)
    np.testing.assert_allclose(reached.p, goal.p, atol=1e-5)
    np.testing.assert_allclose(reached.R, goal.R, atol=1e-4)
    _, J, _ = solver._linearise(reached, q)
    for k, column in enumerate(solver.columns):
        ahead, behind = np.array(q), np.array(q)
        ahead[column], behind[column] = q[column] + 1e-6, q[column] - 1e-6
        moved = solver.forward(with_mimics(robot, ahead)).p - solver.forward(with_mimics(robot, behind)).p
        np.testing.assert_allclose(moved / 2e-6, J[:3, k], atol=1e-6)
