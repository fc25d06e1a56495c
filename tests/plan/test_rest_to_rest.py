from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.core.errors import NotPlannable
from manipcli.model.robot import RobotModel
from manipcli.plan.limit_check import verify
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.rest_to_rest import rest_to_rest

PERIOD = 1e-3


def limits(velocity: object, acceleration: object, jerk: object = np.inf) -> MotionLimits:
    v, a, j = np.broadcast_arrays(*(np.atleast_1d(np.asarray(x, dtype=float)) for x in (velocity, acceleration, jerk)))
    names = tuple(f"j{k}" for k in range(len(v)))
    return MotionLimits(names, np.full(len(v), -9.0), np.full(len(v), 9.0), v, a, j)


def test_one_radian_at_100_rad_s2_takes_a_fifth_of_a_second() -> None:
    """Bang-bang from rest to rest: T = 2 sqrt(d / a) = 0.2 s, peak 10 rad/s, below the velocity limit."""
    motion = rest_to_rest([0.0], [1.0], limits(100.0, 100.0), period=PERIOD)
    assert motion.duration == pytest.approx(0.2, rel=1e-9)
    assert np.max(motion.velocities) == pytest.approx(10.0)


@pytest.mark.slow
@given(st.floats(0.01, 3.0), st.floats(0.2, 5.0), st.floats(0.5, 50.0))
@settings(max_examples=40, deadline=None)
def test_duration_is_that_of_the_trapezoid(distance: float, v: float, a: float) -> None:
    """T = d/v + v/a with a plateau, 2 sqrt(d/a) without; rounded up to the next tick, never down."""
    exact = distance / v + v / a if distance * a >= v * v else 2.0 * np.sqrt(distance / a)
    motion = rest_to_rest([0.0], [distance], limits(v, a), period=PERIOD)
    assert exact - 1e-8 <= motion.duration <= exact + PERIOD + 1e-8


@pytest.mark.slow
@given(
    st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=7),
    st.floats(0.1, 4.0),
    st.floats(0.5, 40.0),
    st.sampled_from([np.inf, 20.0, 500.0]),
)
@settings(max_examples=40, deadline=None)
def test_moves_in_phase_on_a_straight_line_within_its_limits(
    ends: list[tuple[float, float]], v: float, a: float, j: float
) -> None:
    start, goal = np.array(ends).T
    bound = limits(np.full(len(ends), v), a, j)
    motion = rest_to_rest(start, goal, bound, period=PERIOD)
    verify(motion, bound, tolerance=1e-6)
    np.testing.assert_allclose(motion.times, np.arange(len(motion.times)) * PERIOD)
    np.testing.assert_allclose(motion.positions[0], start, atol=1e-12)
    np.testing.assert_array_equal(motion.positions[-1], goal)
    np.testing.assert_array_equal(motion.velocities[[0, -1]], 0.0)
    delta = goal - start
    far = int(np.argmax(np.abs(delta)))
    if abs(delta[far]) > 1e-6:
        s = (motion.positions[:, far] - start[far]) / delta[far]
        np.testing.assert_allclose(motion.positions, start + s[:, None] * delta, atol=1e-9)


def test_velocity_and_acceleration_are_the_derivatives_of_position() -> None:
    """Central differences; exact for the piecewise cubic up to jerk * dt^2 / 6 and jerk * dt."""
    motion = rest_to_rest([0.0, 1.0], [1.0, 0.5], limits([2.0, 2.0], 10.0, 100.0), period=PERIOD)
    q, v, a = motion.positions, motion.velocities, motion.accelerations
    np.testing.assert_allclose((q[2:] - q[:-2]) / (2 * PERIOD), v[1:-1], atol=100.0 * PERIOD**2)
    np.testing.assert_allclose((v[2:] - v[:-2]) / (2 * PERIOD), a[1:-1], atol=100.0 * PERIOD)


def test_without_motion_it_holds_for_one_period() -> None:
    motion = rest_to_rest([0.3], [0.3], limits(1.0, 1.0), period=PERIOD)
    np.testing.assert_array_equal(motion.positions, [[0.3], [0.3]])
    assert motion.duration == PERIOD


def test_what_is_not_finite_is_refused() -> None:
    with pytest.raises(NotPlannable, match="not finite"):
        rest_to_rest([0.0], [np.nan], limits(1.0, 1.0), period=PERIOD)


def test_missing_limits_are_named_with_their_remedy(make_arm7: Callable[..., RobotModel]) -> None:
    robot = make_arm7(acceleration=0.0)
    with pytest.raises(NotPlannable, match="joint 'joint_1' has no usable acceleration limit") as refused:
        MotionLimits.of(robot, ("joint_1",))
    assert "limits: {joint_1: {acceleration: ...}}" in str(refused.value.hint)


def test_scales_slow_down_velocity_and_acceleration(make_arm7: Callable[..., RobotModel]) -> None:
    robot = make_arm7(jerk=100.0)
    slow = MotionLimits.of(robot, ("joint_1",), velocity_scale=0.5, acceleration_scale=0.1)
    np.testing.assert_allclose([slow.velocity[0], slow.acceleration[0], slow.jerk[0]], [1.0, 1.0, 10.0])
