from __future__ import annotations

import sys
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle, matrix_from_rpy
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.plan.damped_step import solve_kernel
from manipcli.plan.inverse_kinematics import (
    ANGLE_TOLERANCE,
    POSITION_TOLERANCE,
    InverseKinematics,
    Solution,
)
from manipcli.plan.pose_error import Open, PoseTolerance, pointed, rotation_vector

ARM = tuple(f"joint_{k}" for k in range(1, 8))
X_LT = Transform.of(xyz=(0.02, 0.0, 0.15), rpy=(0.1, 0.2, 0.3))


@pytest.fixture(scope="module")
def solver(make_arm7: Callable[..., RobotModel]) -> InverseKinematics:
    return InverseKinematics(Kinematics(make_arm7()), ARM, "link_7", X_LT=X_LT)


def arm_forward(q: Array) -> Transform:
    """The fixture's chain by hand: products of rotations about z and y with offsets along z."""
    X = Transform.identity()
    for k, (angle, offset) in enumerate(zip(q, (0.16, 0.16, 0.2, 0.22, 0.2, 0.2, 0.2), strict=True)):
        axis = (0.0, 0.0, 1.0) if k % 2 == 0 else (0.0, 1.0, 0.0)
        X = X @ Transform.of(xyz=(0, 0, offset), R=matrix_from_axis_angle(axis, float(angle)))
    return X @ X_LT


def random_positions(robot_limits: tuple[Array, Array], count: int, seed: int) -> Array:
    lower, upper = robot_limits
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(lower)))


LIMITS = np.array([-2.9, -2.0, -2.9, -2.0, -2.9, -2.0, -3.0]), np.array([2.9, 2.0, 2.9, 2.0, 2.9, 2.0, 3.0])


def test_every_reachable_pose_is_reached_within_the_limits(solver: InverseKinematics, middle: Array) -> None:
    """Poses of random positions inside the limits are reachable by construction; the chain by hand is the oracle."""
    rng = np.random.default_rng(0)
    for arm in random_positions(LIMITS, 60, 1):
        goal = arm_forward(arm)
        q = solver.solve(goal, middle, rng)
        reached = arm_forward(q[:7])
        assert np.linalg.norm(reached.p - goal.p) <= POSITION_TOLERANCE
        assert np.linalg.norm(rotation_vector(reached.R.T @ goal.R)) <= ANGLE_TOLERANCE
        assert (q[:7] >= LIMITS[0]).all()
        assert (q[:7] <= LIMITS[1]).all()
        np.testing.assert_array_equal(q[7:], middle[7:])


def test_a_goal_near_the_seed_gives_positions_near_the_seed(solver: InverseKinematics, middle: Array) -> None:
    near = middle.copy()
    near[:7] += 0.02
    q = solver.solve(solver.forward(near), middle, np.random.default_rng(0))
    assert np.max(np.abs(q - middle)) < 0.1


@pytest.mark.parametrize(
    ("joints", "leaving"), [(3, "rotation"), (4, "rotation"), (5, "spin"), (7, "spin"), (7, "rotation")]
)
def test_what_a_goal_leaves_open_does_not_count_and_the_rest_does(
    solver: InverseKinematics, middle: Array, joints: int, leaving: Open
) -> None:
    """Of the tool's orientation the goal gets what is left open at random: an arm of few joints comes there all the
    same, because the rest was made by its own positions."""
    rng = np.random.default_rng(4)
    few = InverseKinematics(solver._kinematics, ARM[:joints], "link_7", X_LT=X_LT).leaving(leaving)
    for arm in random_positions(LIMITS, 30, 2):
        arm[joints:] = middle[joints:7]
        made = arm_forward(arm)
        turn = matrix_from_axis_angle((0.0, 0.0, 1.0), rng.uniform(-3.0, 3.0))
        R = made.R @ turn if leaving == "spin" else matrix_from_rpy(rng.uniform(-1.5, 1.5, 3))
        reached = arm_forward(few.solve(Transform.of(xyz=made.p, R=R), middle, rng)[:7])
        assert np.linalg.norm(reached.p - made.p) <= POSITION_TOLERANCE
        if leaving == "spin":
            assert np.arccos(min(1.0, reached.R[:, 2] @ made.R[:, 2])) <= ANGLE_TOLERANCE + 1e-7


def test_a_point_that_is_reached_and_not_in_that_direction_is_told_so(solver: InverseKinematics, middle: Array) -> None:
    few = InverseKinematics(solver._kinematics, ARM[:3], "link_7", X_LT=X_LT).leaving("spin")
    arm = np.array([*random_positions(LIMITS, 1, 2)[0][:3], *middle[3:7]])
    made = arm_forward(arm)
    away = Transform.of(xyz=made.p, R=made.R @ matrix_from_rpy([1.0, 0.0, 0.0]))
    with pytest.raises(NotPlannable) as refused:
        few.solve(away, np.array([*arm[:3] + 0.02, *middle[3:]]), np.random.default_rng(0))
    assert refused.value.hint == "remove `pointing`: the tool then reaches the point, pointing 57 deg off"


@pytest.mark.parametrize("leaving", ["nothing", "spin", "yaw", "rotation"])
def test_the_jacobian_is_that_of_the_error_at_the_goal(solver: InverseKinematics, middle: Array, leaving: Open) -> None:
    """Central differences of the error; away from the goal the one of a rotation vector is another."""
    own = solver.leaving(leaving)
    for arm in random_positions(LIMITS, 5, 7):
        q = np.array([*arm, *middle[7:]])
        goal = own.forward(q)
        _, J, _ = own._linearise(goal, q)
        for k in range(7):
            step = np.zeros(len(q))
            step[k] = 1e-6
            ahead, behind = (own._linearise(goal, q + sign * step)[0] for sign in (1.0, -1.0))
            np.testing.assert_allclose((ahead - behind) / 2e-6, -J[:, k], atol=1e-6)


@pytest.mark.parametrize("z", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.6, 0.0, 0.8), (-0.8, 0.6, 0.0)])
def test_an_orientation_is_pointed_by_the_least_turn(z: tuple[float, float, float]) -> None:
    for R in (np.eye(3), matrix_from_rpy((0.4, -0.9, 2.0))):
        turned = pointed(R, np.array(z))
        np.testing.assert_allclose(turned[:, 2], z, atol=1e-12)
        np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turned) == pytest.approx(1.0)
        between = np.arccos(np.clip(R[:, 2] @ np.array(z), -1.0, 1.0))
        assert np.linalg.norm(rotation_vector(turned @ R.T)) == pytest.approx(between, abs=1e-7)


def test_same_seed_same_answer(solver: InverseKinematics, middle: Array) -> None:
    goal = arm_forward(random_positions(LIMITS, 1, 5)[0])
    first, second = (solver.solve(goal, middle, np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_goal_out_of_reach_names_error_and_distance(solver: InverseKinematics, middle: Array) -> None:
    with pytest.raises(
        NotPlannable, match=r"3\.000 m from the robot's base: the nearest pose is \d+\.\d mm"
    ) as refused:
        solver.solve(Transform.of(xyz=(3.0, 0.0, 0.0)), middle, np.random.default_rng(0))
    assert refused.value.hint is not None


def test_a_goal_in_millimetres_is_guessed(solver: InverseKinematics, middle: Array) -> None:
    with pytest.raises(NotPlannable) as refused:
        solver.solve(Transform.of(xyz=(500.0, 0.0, 400.0)), middle, np.random.default_rng(0))
    assert "millimetres" in (refused.value.hint or "")


def test_an_arm_of_few_joints_is_told_of_points(
    solver: InverseKinematics, make_arm7: Callable[..., RobotModel], middle: Array
) -> None:
    goal = Transform.of(xyz=(0.3, 0.0, 0.8), rpy=(0.5, 0.5, 0.5))
    two = InverseKinematics(Kinematics(make_arm7()), ARM[:2], "link_7", X_LT=X_LT)
    with pytest.raises(NotPlannable) as refused:
        two.solve(goal, middle, np.random.default_rng(0))
    assert "an arm of 2 joints reaches few orientations: leave it open with `move: {point: ...}`" in (
        refused.value.hint or ""
    )
    with pytest.raises(NotPlannable) as refused:
        solver.solve(Transform.of(xyz=(3.0, 0.0, 0.8)), middle, np.random.default_rng(0))
    assert "few" not in (refused.value.hint or "")


def test_a_pose_that_is_barely_missed_is_told_with_what_would_have_counted(middle: Array) -> None:
    told = Solution(middle, position_error=2.4e-6, angle_error=1.5e-4, at_limit=()).explain(PoseTolerance(1e-5, 1e-4))
    assert told.startswith("the nearest pose is 0.0024 mm and 0.0086 deg off, the tolerance is 0.01 mm and 0.0057 deg")
    assert Solution(middle, 0.03, 0.1, ()).explain() == "the nearest pose is 30.0 mm and 5.7 deg off, out of reach"


def test_limits_that_hold_the_arm_back_are_named(make_arm7: Callable[..., RobotModel], middle: Array) -> None:
    """Joint 1 alone turns the tool about z; 3.1 rad is past its limit of 2.9."""
    solver = InverseKinematics(Kinematics(make_arm7()), ("joint_1",), "link_7")
    past = middle.copy()
    past[0] = 3.1
    with pytest.raises(NotPlannable, match="at the limits of joint_1"):
        solver.solve(solver.forward(past), middle, np.random.default_rng(0))


def test_refused_solutions_are_passed_over_and_named_when_all_are(solver: InverseKinematics, middle: Array) -> None:
    goal = solver.forward(middle)
    other = solver.solve(goal, middle, np.random.default_rng(0), refuse=lambda q: "elbow up" if q[3] < 0.0 else None)
    assert other[3] >= 0.0
    with pytest.raises(NotPlannable, match="only where the hand is in the wall"):
        solver.solve(goal, middle, np.random.default_rng(0), refuse=lambda _: "the hand is in the wall")


def test_nan_is_refused(solver: InverseKinematics, middle: Array) -> None:
    with pytest.raises(NotPlannable, match="not finite"):
        solver.solve(Transform.of(xyz=(np.nan, 0.0, 0.0)), middle, np.random.default_rng(0))


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, 3.0, np.pi - 1e-6, np.pi])
def test_rotation_vector_inverts_axis_and_angle(angle: float) -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    vector = rotation_vector(matrix_from_axis_angle(axis, angle))
    sign = 1.0 if vector @ axis >= 0.0 else -1.0  # at pi, both axes are the same rotation
    np.testing.assert_allclose(sign * vector, axis * angle, atol=1e-8)


def broken(*_: object) -> Array:
    raise TypeError("another signature")


@pytest.mark.parametrize(
    "module",
    [None, SimpleNamespace(), SimpleNamespace(solve1=broken), SimpleNamespace(solve1=lambda H, b: b), "is not there"],
)
def test_a_numpy_without_the_kernel_is_as_good(module: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """Missing, without the function, with another one, and with other results."""
    if module != "is not there":
        monkeypatch.setitem(sys.modules, "other_numpy", module)
    assert solve_kernel("other_numpy") is np.linalg.solve


def test_the_kernel_gives_the_bits_of_solve() -> None:
    rng = np.random.default_rng(3)
    for n in (1, 2, 6, 7):
        J = rng.normal(size=(6, n))
        H, b = J.T @ J + 1e-6 * np.eye(n), rng.normal(size=n)
        np.testing.assert_array_equal(solve_kernel()(H, b), np.linalg.solve(H, b))
