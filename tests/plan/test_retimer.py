from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.plan.limit_check import verify
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path import joint_path
from manipcli.plan.rest_to_rest import rest_to_rest
from manipcli.plan.retimer import retime

PERIOD = 1e-3
JOINTS = ("a", "b", "c")


def limits(jerk: float | tuple[float, ...] = np.inf) -> MotionLimits:
    wide = np.full(3, 9.0)
    return MotionLimits(JOINTS, -wide, wide, np.array([1.0, 1.5, 2.0]), np.array([5.0, 8.0, 10.0]), np.zeros(3) + jerk)


def line(count: int) -> Array:
    return np.linspace(0.0, 1.0, count)[:, None] * np.array([1.0, -0.7, 0.4])


def test_many_points_on_a_line_take_as_long_as_the_line() -> None:
    """The oracle is the exact rest-to-rest time of the same straight line; grid points cost up to 0.5 %."""
    exact = rest_to_rest(line(2)[0], line(2)[1], limits(), period=PERIOD).duration
    assert retime(joint_path(line(30)), limits(), period=PERIOD).duration == pytest.approx(exact, rel=0.005)


@given(st.integers(0, 10_000), st.sampled_from([np.inf, 150.0]))
@settings(max_examples=12, deadline=None)
def test_keeps_every_limit_rests_at_both_ends_and_passes_the_waypoints(seed: int, jerk: float) -> None:
    points = np.random.default_rng(seed).uniform(-1.0, 1.0, (5, 3))
    motion = retime(joint_path(points), limits(jerk), period=PERIOD)
    verify(motion, limits(jerk))
    np.testing.assert_allclose(motion.times, np.arange(len(motion.times)) * PERIOD)
    np.testing.assert_allclose(motion.positions[[0, -1]], points[[0, -1]], atol=1e-9)
    np.testing.assert_array_equal(motion.velocities[-1], 0.0)
    np.testing.assert_allclose(motion.velocities[0], 0.0, atol=1e-6)
    # Two ticks are at most 2 ms * |v| <= 5 mrad apart, so a point passed exactly lies within half of that of a sample.
    for point in points:
        assert np.min(np.linalg.norm(motion.positions - point, axis=1)) < 0.0025


def test_velocity_and_acceleration_are_the_derivatives_of_position() -> None:
    """Trapezoid means over a tick; the jumps of acceleration (at most 20 rad/s^2, few) are left out by the median."""
    points = np.random.default_rng(3).uniform(-1.0, 1.0, (4, 3))
    motion = retime(joint_path(points), limits(), period=PERIOD)
    q, v, a = motion.positions, motion.velocities, motion.accelerations
    np.testing.assert_allclose(np.diff(q, axis=0) / PERIOD, 0.5 * (v[1:] + v[:-1]), atol=0.02)
    assert np.median(np.abs(np.diff(v, axis=0) / PERIOD - 0.5 * (a[1:] + a[:-1]))) < 0.02


def test_some_joint_is_at_a_limit_nearly_always() -> None:
    """Time-optimal means bang-bang: at nearly every tick a velocity or an acceleration is saturated."""
    points = np.random.default_rng(5).uniform(-1.0, 1.0, (4, 3))
    motion = retime(joint_path(points), limits(), period=PERIOD)
    v = np.max(np.abs(motion.velocities) / limits().velocity, axis=1)
    a = np.max(np.abs(motion.accelerations) / limits().acceleration, axis=1)
    assert np.mean(np.maximum(v, a) > 0.97) > 0.93


def test_jerk_limit_costs_time_and_leaves_the_path() -> None:
    points = np.random.default_rng(7).uniform(-1.0, 1.0, (4, 3))
    free = retime(joint_path(points), limits(), period=PERIOD)
    smooth = retime(joint_path(points), limits(100.0), period=PERIOD)
    assert free.duration < smooth.duration < 1.5 * free.duration
    for q in smooth.positions[::100]:
        assert np.min(np.linalg.norm(free.positions - q, axis=1)) < 0.003


@pytest.mark.parametrize("jerk", [(20.0, 800.0, 1000.0), (500.0, 16.0, 1000.0), (500.0, np.inf, 20.0)])
def test_one_joint_of_little_jerk_costs_little_more_than_it_must(jerk: tuple[float, ...]) -> None:
    """The oracle is the exact time of the same line; where not the slowest joint is that of the least jerk, a third."""
    exact = rest_to_rest(line(2)[0], line(2)[1], limits(jerk), period=PERIOD).duration
    motion = retime(joint_path(line(30)), limits(jerk), period=PERIOD)
    verify(motion, limits(jerk))
    assert np.all(np.abs(np.diff(motion.accelerations, axis=0)) / PERIOD <= np.array(jerk) * (1.0 + 1e-6))
    assert exact <= motion.duration < 1.35 * exact


@pytest.mark.parametrize("joint", [0, 1, 2])
@pytest.mark.parametrize("more", [3.0, 30.0, 1e3, 1e6])
def test_a_looser_limit_of_acceleration_makes_nothing_slower(joint: int, more: float) -> None:
    """The oracle is the exact time of the same line. Joint 2 hardly moves, and is never the slowest."""
    points = line(30) * np.array([1.0, 1.0, 1e-3])
    loose = limits(100.0)
    loose.acceleration[joint] *= more
    exact = rest_to_rest(points[0], points[-1], loose, period=PERIOD).duration
    motion = retime(joint_path(points), loose, period=PERIOD)
    verify(motion, loose)
    assert motion.duration <= 1.01 * retime(joint_path(points), limits(100.0), period=PERIOD).duration
    assert motion.duration <= 1.1 * exact


def test_without_a_jerk_limit_it_sets_off_with_all_its_acceleration() -> None:
    motion = retime(joint_path(line(30)), limits(), period=PERIOD)
    assert np.max(np.abs(motion.accelerations[0]) / limits().acceleration) > 0.99


def test_two_waypoints_are_the_straight_move_and_one_is_a_rest(make_arm7: Callable[..., RobotModel]) -> None:
    robot = make_arm7(jerk=100.0)
    bound = MotionLimits.of(robot, ("joint_1", "joint_2"))
    moved = retime(joint_path([[0.0, 0.0], [1.0, -0.5]]), bound, period=PERIOD)
    np.testing.assert_array_equal(
        moved.positions, rest_to_rest([0.0, 0.0], [1.0, -0.5], bound, period=PERIOD).positions
    )
    rest = retime(joint_path([[0.2, 0.1], [0.2, 0.1]]), bound, period=PERIOD)
    assert np.ptp(rest.positions) == pytest.approx(0.1)


@pytest.mark.slow
@pytest.mark.parametrize("after", ["", "import matplotlib.pyplot as plt; assert plt.plot and not hasattr(plt, 'nope')"])
def test_matplotlib_is_not_imported_for_it_and_stays_importable(after: str) -> None:
    program = (
        "import sys, numpy as np\n"
        "from manipcli.plan.motion_limits import MotionLimits\n"
        "from manipcli.plan.path import joint_path\n"
        "from manipcli.plan.retimer import retime\n"
        "one = np.ones(1)\n"
        "limits = MotionLimits(('a',), -9 * one, 9 * one, one, one, one * np.inf)\n"
        "retime(joint_path([[0.0], [0.3], [1.0]]), limits, period=1e-3)\n"
        "assert not [name for name in sys.modules if name.startswith('matplotlib')]\n"
        f"{after}\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


@pytest.mark.parametrize(("limit", "period"), [((1.0, 10.0, np.inf), 1e-3), ((2.0, 10.0, 1000.0), 2e-3)])
def test_a_path_that_turns_back_on_itself_keeps_its_limits(limit: tuple[float, ...], period: float) -> None:
    """One joint over the top of a sine: a bend so narrow that it lies between two ticks."""
    points = np.sin(np.linspace(1.0, 3.0, 80))[:, None]
    within = MotionLimits(("a",), np.full(1, -9.0), np.full(1, 9.0), *(np.array([each]) for each in limit))
    verify(retime(joint_path(points), within, period=period), within)
