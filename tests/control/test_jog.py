"""Jogging: limits under random velocities, the path of the tool, stops, and what preempts what."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.control.action import GoalRejected
from manipcli.control.controller import JointState
from manipcli.control.controllers.computed_torque import ComputedTorqueController
from manipcli.control.impedance_controller import CartesianImpedanceController
from manipcli.control.jog import JogLaw
from manipcli.control.jog_targets import JointTarget, TaskVelocity, ToolTarget
from manipcli.control.roles import Follower, is_jogged
from manipcli.control.trajectory_controller import JointTrajectoryController
from manipcli.control.trajectory_goal import JointFacts
from manipcli.core.geometry import Array
from manipcli.description.elements import JointLimits
from manipcli.model.configuration import configuration
from manipcli.model.kinematics import Kinematics
from manipcli.plan.from_motion import stopped
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint

PERIOD = 0.001
TASK = pipeline.load_task(Path(__file__).parents[2] / "tasks/home.yaml")
ROBOT = TASK.robot
KINEMATICS = Kinematics(ROBOT)
HOME = configuration(ROBOT)
ARM = ROBOT.group("arm").joints
COLUMNS = ROBOT.indices(ARM)
FACTS = JointFacts.of(ARM, [ROBOT.joint(name).limits for name in ARM], [ROBOT.joint(name).type for name in ARM])
BENT = np.array([0.3, 0.6, 0.2, -1.4, 0.1, 0.7, 0.0])
assert ROBOT.tool is not None
TOOL = (ROBOT.tool.link, ROBOT.tool.X_LT)


def tool(twist: object, axes: str | None = None) -> ToolTarget:
    return ToolTarget(KINEMATICS, ARM, HOME, TOOL, np.array(twist, dtype=float), axes=axes)


def pose(q: Array) -> tuple[Array, Array]:
    """R_WT and p_WT."""
    full = HOME.copy()
    full[COLUMNS] = q
    R, p, _ = KINEMATICS.pose_and_jacobian(full, *TOOL)
    return R, p


def law() -> JogLaw:
    return JogLaw(FACTS, FACTS.lower, FACTS.upper)


def motion(target: object, q: Array, ticks: int, dt: float = PERIOD) -> tuple[Array, Array]:
    """Positions and velocities (T, n) from rest at `q`."""
    made, v, rows = law(), np.zeros(len(q)), []
    for _ in range(ticks):
        q, v = made.step(q, v, target, dt)  # type: ignore[arg-type]
        rows.append((q, v))
    return np.array([q for q, _ in rows]), np.array([v for _, v in rows])


def test_no_limit_is_exceeded_by_1000_random_messages() -> None:
    rng = np.random.default_rng(1)
    made, q, v, dt = law(), np.array(HOME[COLUMNS]), np.zeros(len(ARM)), 0.01
    nearest = np.inf
    for _ in range(1000):
        kind = rng.random()
        if kind < 0.45:
            axes = (None, "", ROBOT.root)[rng.integers(3)]
            target: ToolTarget | JointTarget | None = tool(rng.normal(size=6) * 10 ** rng.uniform(-2, 2), axes)
        else:
            target = None if kind < 0.5 else JointTarget((rng.normal(size=len(ARM)) + 1) * 10 ** rng.uniform(-1, 2))
        for _ in range(rng.integers(1, 7)):
            after, speed = made.step(q, v, target, dt)
            np.testing.assert_allclose(after, q + 0.5 * dt * (v + speed), atol=1e-14, rtol=0.0)
            assert (np.abs(speed - v) <= FACTS.acceleration * dt * (1 + 1e-9)).all()
            assert (np.abs(speed) <= FACTS.velocity * (1 + 1e-12)).all()
            assert ((after >= FACTS.lower) & (after <= FACTS.upper)).all()
            q, v = after, speed
            nearest = min(nearest, float(np.minimum(q - FACTS.lower, FACTS.upper - q).min()))
    assert nearest < 1e-3


@pytest.mark.parametrize("axes", [None, ""])
def test_a_twist_is_the_velocity_of_the_tool(axes: str | None) -> None:
    """Straight and at the asked speed after the start, by differences of forward kinematics."""
    linear = np.array([0.06, -0.04, 0.03])
    q, v = motion(tool([*linear, 0, 0, 0], axes), BENT, 700)
    R, begin = pose(BENT)
    wanted = R @ linear if axes == "" else linear
    points = np.array([pose(x)[1] for x in q[::50]]) - begin
    along = points @ wanted / np.linalg.norm(wanted)
    aside = points - np.outer(along, wanted / np.linalg.norm(wanted))
    assert np.abs(aside).max() < 2e-5
    speeds = np.diff(points[4:], axis=0) / (50 * PERIOD)
    np.testing.assert_allclose(speeds, np.tile(wanted, (len(speeds), 1)), atol=1e-5)
    late = np.abs(v[-1] / FACTS.acceleration).max()
    assert along[-1] == pytest.approx(np.linalg.norm(wanted) * (651 * PERIOD - 0.5 * late), abs=1e-3)


def test_a_rotation_about_an_axis_of_the_tool_keeps_its_origin() -> None:
    q, v = motion(tool([0, 0, 0, 0, 0, 0.6], ""), BENT, 1500)
    (first, begin), (last, end) = pose(BENT), pose(q[-1])
    assert np.abs(end - begin).max() < 2e-6
    np.testing.assert_allclose(last[:, 2], first[:, 2], atol=1e-5)
    turned = first.T @ last
    angle = np.arctan2(turned[1, 0], turned[0, 0])
    assert angle == pytest.approx(0.6 * (1.5 - 0.5 * np.abs(v[-1] / FACTS.acceleration).max()), abs=2e-3)


def test_a_stop_takes_the_distance_of_a_constant_deceleration_on_a_straight_line() -> None:
    """The joint that needs longest, T = v / a, stops within v^2 / (2 a), the others within v T / 2."""
    rng = np.random.default_rng(2)
    made = law()
    for _ in range(30):
        q = begin = np.array([0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
        v = first = rng.uniform(-0.7, 0.7, len(ARM)) * FACTS.velocity * 0.5
        longest = (np.abs(v) / FACTS.acceleration).max()
        while v.any():
            q, v = made.step(q, v, None, PERIOD)
            np.testing.assert_allclose(np.cross(v[:3], first[:3]), 0.0, atol=1e-12)
        assert (np.abs(q - begin - first * longest / 2) <= FACTS.acceleration * PERIOD**2).all()


def test_near_a_limit_the_tool_slows_down_on_its_line() -> None:
    """With six joints nothing can make up for the one at its limit, so that the tool stops on its line, before it."""
    rng = np.random.default_rng(3)
    reached = 0
    for _ in range(5):
        J = np.eye(6) + 0.3 * rng.normal(size=(6, 6))
        x = rng.normal(size=6)
        x *= 2.0 / np.abs(np.linalg.solve(J, x)).max()
        limits = [JointLimits(lower=-0.5, upper=0.5, velocity=2.0, acceleration=a) for a in rng.uniform(4, 20, 6)]
        facts = JointFacts.of(tuple("abcdef"), limits, None)
        made = JogLaw(facts, facts.lower, facts.upper)

        class Constant:
            def wish(self, q: Array, J: Array = J, x: Array = x) -> TaskVelocity:
                return TaskVelocity(J, x)

        q, v = np.zeros(6), np.zeros(6)
        for _ in range(1200):
            q, v = made.step(q, v, Constant(), PERIOD)
            moved = J @ q
            assert np.abs(moved - x * (moved @ x) / (x @ x)).max() < 1e-5
        reached += np.abs(q).max() > 0.5 - 1e-4
        assert np.abs(v).max() < 1e-3
    assert reached == 5


def test_at_the_end_of_its_reach_the_tool_stops_on_its_line_and_comes_back() -> None:
    made, q, v = law(), BENT.copy(), np.zeros(len(ARM))
    _, begin = pose(q)
    out, home = tool([0.3, 0, 0, 0, 0, 0]), tool([-0.3, 0, 0, 0, 0, 0])
    for target, ticks in ((out, 600), (home, 600)):
        for tick in range(ticks):
            before = v
            q, v = made.step(q, v, target, 4 * PERIOD)
            assert (np.abs(v) < 0.9 * FACTS.velocity).all()
            if tick % 20 == 0:
                assert np.abs(pose(q)[1] - begin)[1:].max() < 2e-3
        if target is out:
            full = HOME.copy()
            full[COLUMNS] = q
            assert np.linalg.svd(KINEMATICS.jacobian(full, *TOOL)[:, COLUMNS], compute_uv=False)[-1] < 0.01
            reached = pose(q)[1][0]
            assert np.abs(v - before).max() < 1e-3
    assert reached - begin[0] > 0.1
    assert pose(q)[1][0] < reached - 0.15


def test_a_redundant_joint_at_its_limit_does_not_stop_the_tool() -> None:
    q = BENT.copy()
    free = KINEMATICS.jacobian(configuration(ROBOT), TOOL[0])[:, COLUMNS]
    wish = TaskVelocity(free, free @ np.array([0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]))
    bounds = np.full(len(q), 2.0)
    k = int(np.abs(wish.velocity).argmax())
    tight = bounds.copy()
    tight[k] = 0.5 * abs(wish.velocity[k])
    within = wish.within(-tight, tight)
    np.testing.assert_allclose(free @ within, free @ wish.velocity, atol=1e-6)
    assert (np.abs(within) <= tight + 1e-12).all()


def test_directions_in_which_the_joints_never_move_the_tool_are_left_out() -> None:
    """Parallel axes and a joint beyond the tool: the nearest velocity, as by the pseudo-inverse."""
    J = np.zeros((6, 5))
    J[:2, :4] = np.random.default_rng(4).normal(size=(2, 4))
    J[5, :4] = 1.0
    x = np.array([0.1, 0.2, 0.3, 0.1, 0.0, 0.1])
    np.testing.assert_allclose(TaskVelocity(J, x).velocity, np.linalg.pinv(J) @ x, atol=1e-12)


def controller(**more: object) -> JointTrajectoryController:
    return JointTrajectoryController(
        name="arm", joints=ARM, command_interfaces=("position",), stop_planner=stopped,
        limits=[ROBOT.joint(name).limits for name in ARM], types=[ROBOT.joint(name).type for name in ARM],
        **more,  # type: ignore[arg-type]
    )  # fmt: skip


def run(made: Follower, first: int, ticks: int) -> Array:
    """(T, 4, n) reference and command; the joints are where the reference is."""
    rows, q = [], np.array(BENT)
    for k in range(first, first + ticks):
        q = made.update(k * PERIOD, PERIOD, JointState(q, np.zeros_like(q), np.zeros_like(q))).rows.copy()[0]
        rows.append(made.output.rows.copy())
    return np.array(rows)


def story() -> tuple[Array, list[str]]:
    """A goal, jogged away after 0.3 s, another goal in the middle of the jog, its cancel, and a jog that ends."""
    made = controller()
    rows = [run(made, 0, 10)]
    goal = lambda to: JointTrajectory(ARM, [TrajectoryPoint(to, 2.0)])  # noqa: E731
    first = made.send_goal(goal(BENT + 0.4))
    rows.append(run(made, 10, 300))
    made.jog(tool([0.1, 0.0, 0.05, 0, 0, 0]), until=10.0)
    rows.append(run(made, 310, 400))
    second = made.send_goal(goal(BENT))
    rows.append(run(made, 710, 300))
    second.cancel()
    made.jog(JointTarget(np.full(len(ARM), 0.3)), until=1.2)
    rows.append(run(made, 1010, 800))
    return np.concatenate(rows), [handle.result.text if handle.result else "" for handle in (first, second)]


def test_a_jog_and_a_goal_preempt_each_other_without_a_jump() -> None:
    rows, texts = story()
    assert texts[0] == "preempted by jogging"
    assert texts[1].startswith("canceled")
    steps, speeds = np.diff(rows[:, 0], axis=0), np.diff(rows[:, 1], axis=0)
    assert (np.abs(steps) <= FACTS.velocity * PERIOD * 1.001).all()
    jogged = np.r_[310:709, 1010:1799]
    assert (np.abs(speeds[jogged]) <= FACTS.acceleration * PERIOD * 1.001).all()
    np.testing.assert_allclose(steps[jogged], 0.5 * PERIOD * (rows[jogged, 1] + rows[jogged + 1, 1]), atol=1e-12)
    np.testing.assert_allclose(rows[jogged, 3], rows[jogged + 1, 0], atol=1e-12)  # fed forward by a tick
    np.testing.assert_allclose(np.abs(steps - PERIOD * rows[:-1, 1]).max(), 0.0, atol=1e-4)
    assert not rows[-1, 1].any()
    np.testing.assert_array_equal(story()[0], rows)


def test_the_arm_stops_when_the_time_of_the_target_is_over() -> None:
    made = controller()
    run(made, 0, 5)
    made.jog(JointTarget(np.array([0.5, 0, 0, 0, 0, 0, 0])), until=0.305)
    rows = run(made, 5, 600)
    a = FACTS.acceleration[0]
    assert rows[299, 1, 0] == pytest.approx(0.5)
    assert rows[-1, 0, 0] - BENT[0] == pytest.approx(0.5 * 0.3, abs=1e-3)  # v^2 / 2a are missed and made up for
    assert rows[-1, 0, 0] - rows[300, 0, 0] == pytest.approx(0.5**2 / (2 * a), abs=1e-3)
    assert not rows[-1, 1].any()


def test_all_controllers_of_trajectories_have_the_same_reference() -> None:
    limits, types = [ROBOT.joint(name).limits for name in ARM], [ROBOT.joint(name).type for name in ARM]
    others = (
        ComputedTorqueController(name="arm", joints=ARM, limits=limits, types=types),
        CartesianImpedanceController(
            name="arm", joints=ARM, kinematics=KINEMATICS, link=TOOL[0], stiffness=np.full(6, 100.0), limits=limits,
            types=types,
        ),
    )  # fmt: skip
    others[1].set_pose(KINEMATICS.forward(HOME, TOOL[0]))
    rows = []
    for made in (controller(), *others):
        assert is_jogged(made)
        made.jog(tool([0.1, 0, 0, 0, 0.2, 0]), until=10.0)
        rows.append(run(made, 0, 100)[:, :3])
    np.testing.assert_array_equal(rows[1], rows[0])
    np.testing.assert_array_equal(rows[2], rows[0])
    assert np.abs(rows[0][-1, 0] - BENT).max() > 1e-3


def test_a_paused_or_inactive_controller_does_not_jog() -> None:
    made = controller(speed_scaling=0.0)
    run(made, 0, 5)
    made.jog(JointTarget(np.full(len(ARM), 0.5)), until=10.0)
    np.testing.assert_array_equal(run(made, 5, 20)[-1, 0], BENT)
    made.accepts_goals = False
    with pytest.raises(GoalRejected, match="not active"):
        made.jog(JointTarget(np.zeros(len(ARM))), until=10.0)
