"""Sampling of joint trajectories against closed forms, finite differences and the values of the points themselves."""

import math
from datetime import timedelta
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.core.errors import InvalidArgument, ManipcliError
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint


def one_joint(*points, start=None):
    return JointTrajectory(("j",), points, start)


def at(position, time, velocity=None, acceleration=None):
    return TrajectoryPoint(
        positions=[position],
        time_from_start=time,
        velocities=None if velocity is None else [velocity],
        accelerations=None if acceleration is None else [acceleration],
    )


def values(trajectory, time):
    return tuple(float(array[0]) for array in trajectory.sample(time))


def test_positions_alone_are_joined_by_lines_and_held_at_rest_after_the_end():
    """Conformance 29: points 1, 2, 3 at 1, 2, 3 s from 0."""
    trajectory = one_joint(at(1, 1.0), at(2, 2.0), at(3, 3.0), start=at(0, 0.0))
    assert values(trajectory, 0.5) == pytest.approx((0.5, 1.0, 0.0))
    assert values(trajectory, 1.5)[0] == pytest.approx(1.5)
    assert values(trajectory, 2.5)[0] == pytest.approx(2.5)
    for later in (3.125, 30.0):
        assert values(trajectory, later) == (3.0, 0.0, 0.0)


def test_nothing_is_known_before_the_first_point():
    """Conformance 29: no sample before the first point."""
    with pytest.raises(InvalidArgument, match=r"begins at 1 s"):
        one_joint(at(1, 1.0), at(2, 2.0)).sample(0.999)
    with pytest.raises(ValueError, match="cannot sample"):
        one_joint(at(1, 0.0), at(2, 2.0)).sample(np.array([0.0, -1e-9]))
    with pytest.raises(InvalidArgument):
        one_joint(at(1, 0.0)).sample(math.nan)


def test_cubic_reproduces_x3_minus_2x():
    """Conformance 30: x^3 - 2x over 2 s."""
    trajectory = one_joint(at(4, 2.0, velocity=10), start=at(0, 0.0, velocity=-2))
    assert values(trajectory, math.sqrt(2)) == pytest.approx((0.0, 4.0, 6 * math.sqrt(2)), abs=1e-12)
    assert values(trajectory, 2.0) == pytest.approx((4.0, 10.0, 12.0), abs=1e-12)


@pytest.mark.parametrize(
    ("acceleration", "time", "expected"),
    [
        (None, 0.25, (0.15625, 1.125, 3.0)),
        (None, 0.5, (0.5, 1.5, 0.0)),
        (0.0, 0.25, (0.103515625, 1.0546875, 5.625)),
        (0.0, 0.5, (0.5, 1.875, 0.0)),
    ],
)
def test_rest_to_rest_in_one_second(acceleration, time, expected):
    """Conformance 32: cubic and quintic from 0 to 1."""
    trajectory = one_joint(at(0, 0.0, 0.0, acceleration), at(1, 1.0, 0.0, acceleration))
    assert values(trajectory, time) == pytest.approx(expected, abs=1e-12)


def test_accelerations_count_only_where_both_ends_give_them():
    """Conformance 33: an end alone makes no quintic."""
    mixed = one_joint(at(0, 0.0, 0.0), at(1, 1.0, 0.0, 5.0))
    cubic = one_joint(at(0, 0.0, 0.0), at(1, 1.0, 0.0))
    for time in (0.0, 0.3, 0.999):
        assert values(mixed, time) == pytest.approx(values(cubic, time))
    half = one_joint(at(0, 0.0), at(1, 1.0, 3.0), at(2, 2.0, 1.0))
    assert values(half, 0.5) == pytest.approx((0.5, 1.0, 0.0))  # linear: the first point gives no velocity


def test_a_start_lacks_nothing_that_the_first_point_gives():
    """Conformance 33: what the start lacks counts as 0."""
    lacking = one_joint(at(1, 1.0, 0.0, 0.0), start=at(0, 0.0))
    full = one_joint(at(1, 1.0, 0.0, 0.0), start=at(0, 0.0, 0.0, 0.0))
    assert values(lacking, 0.25) == pytest.approx(values(full, 0.25))
    assert values(lacking, 0.25)[0] == pytest.approx(0.103515625)


def test_no_lead_in_when_the_first_point_is_at_the_start():
    assert values(one_joint(at(5, 0.0), at(6, 1.0), start=at(0, 0.0)), 0.0)[0] == 5.0


def test_velocities_alone_are_integrated():
    """Conformance 34: 1, 2, 1 at 1, 2, 3 s from rest, by the trapezoid rule."""
    points = [TrajectoryPoint(velocities=[v], time_from_start=k + 1) for k, v in enumerate((1, 2, 1))]
    trajectory = one_joint(*points, start=at(0, 0.0))
    assert trajectory.sample(np.array([1.0, 2.0, 3.0]))[0][:, 0] == pytest.approx([0.5, 2.0, 3.5])
    assert trajectory.integrated
    # The velocity of the cubics is then linear between the points: p = t^2 / 2 in the first second.
    assert values(trajectory, 0.6) == pytest.approx((0.18, 0.6, 1.0))


def test_accelerations_alone_are_integrated_twice():
    """Conformance 34: the same numbers as accelerations."""
    points = [TrajectoryPoint(accelerations=[a], time_from_start=k + 1) for k, a in enumerate((1, 2, 1))]
    position, velocity, acceleration = one_joint(*points, start=at(0, 0.0)).sample(np.array([1.0, 2.0, 3.0]))
    assert position[:, 0] == pytest.approx([0.25, 1.5, 4.25])
    assert velocity[:, 0] == pytest.approx([0.5, 2.0, 3.5])
    assert acceleration[:, 0] == pytest.approx([1.0, 2.0, 1.0])


def test_integrated_points_without_a_start_cannot_be_sampled():
    points = [TrajectoryPoint(velocities=[1.0, 2.0], time_from_start=1.0)]
    trajectory = JointTrajectory(("a", "b"), points)
    with pytest.raises(InvalidArgument, match="has no positions"):
        trajectory.sample(1.0)
    start = TrajectoryPoint([10.0, 20.0])
    placed = JointTrajectory(("b", "a"), trajectory.of_joints(("b", "a")).source, start)
    assert placed.sample(1.0)[0] == pytest.approx([11.0, 20.5])


def test_without_interpolation_the_next_point_holds_at_once():
    """Conformance 35: before the first point the start; inside a segment its end."""
    points = [at(1, 1.0), at(2, 2.0), at(3, 3.0)]
    trajectory = JointTrajectory(("j",), points, at(0.5, 0.0), interpolation="none")
    times = np.array([0.0, 0.99, 1.0, 1.5, 2.5, 3.0, 30.0])
    assert trajectory.sample(times)[0][:, 0].tolist() == [0.5, 0.5, 2, 2, 3, 3, 3]
    assert not trajectory.sample(times)[1].any()
    with pytest.raises(InvalidArgument, match="expected 'splines' or 'none'"):
        JointTrajectory(("j",), points, interpolation="cubic")


def test_positions_alone_get_the_velocities_of_a_spline():
    """Conformance 37: 0, 0.1, 0.3 each 0.1 s: 2.25 in between, rest at both ends; equal times are refused."""
    trajectory = one_joint(at(0, 0.0), at(0.1, 0.1), at(0.3, 0.2))
    smooth = trajectory.with_spline_velocities()
    assert smooth.velocities[:, 0] == pytest.approx([0.0, 2.25, 0.0])
    # Its acceleration does not jump at the point in the middle: the spline is the one of least curvature.
    left, right = smooth.sample(np.array([0.1 - 1e-9, 0.1 + 1e-9]))[2][:, 0]
    assert left == pytest.approx(right, abs=1e-5)
    moving = trajectory.with_spline_velocities(np.array([1.0]))
    assert moving.velocities[0, 0] == 1.0
    with pytest.raises(InvalidArgument, match="not later"):
        one_joint(at(0, 0.0), at(0.1, 0.1), at(0.3, 0.1))


def test_after_its_end_the_last_point_repeats():
    trajectory = one_joint(at(0, 0.0, 0.0, 0.0), at(1, 1.0, 2.0, 3.0))
    assert values(trajectory, 5.0) == (1.0, 2.0, 3.0)


def test_efforts_are_linear_and_given_at_all_points():
    points = [TrajectoryPoint([0], t, effort=[e]) for t, e in ((1.0, 2.0), (2.0, 6.0))]
    trajectory = JointTrajectory(("j",), points, at(0, 0.0))
    assert [trajectory.sample_effort(t)[0] for t in (0.5, 1.0, 1.25, 9.0)] == pytest.approx([1.0, 2.0, 3.0, 6.0])
    assert one_joint(at(0, 0.0)).sample_effort(np.array([0.0, 1.0])).tolist() == [[0.0], [0.0]]
    with pytest.raises(InvalidArgument, match="point 1 has no efforts"):
        one_joint(points[0], at(1, 2.0))


def test_points_may_be_messages():
    class Duration:
        sec, nanosec = 1, 500_000_000

    class Point:
        positions, velocities, accelerations, effort = [2.0], [], [], []
        time_from_start = Duration()

    trajectory = JointTrajectory(["j"], [Point()], TrajectoryPoint([0.0]))
    assert trajectory.duration == 1.5
    assert values(trajectory, 0.75)[0] == pytest.approx(1.0)


def test_some_joints_in_another_order():
    some = dense().of_joints(("c", "a"))
    for got, whole in zip(some.sample(0.0123), dense().sample(0.0123), strict=True):
        assert np.array_equal(got, whole[[2, 0]])


@given(
    ends=st.lists(st.floats(-3, 3), min_size=6, max_size=6),
    length=st.floats(0.05, 5.0),
    order=st.sampled_from([1, 2]),
)
def test_curves_meet_both_ends_and_their_derivatives_agree(ends, length, order):
    p0, p1, v0, v1, a0, a1 = ends
    if order == 1:
        trajectory = one_joint(at(p0, 0.0, v0), at(p1, length, v1))
    else:
        trajectory = one_joint(at(p0, 0.0, v0, a0), at(p1, length, v1, a1))
    scale = 1.0 + (abs(p1 - p0) + 3) / length**2  # the size of accelerations: what rounding is relative to
    early = [float(x[0]) for x in trajectory.sample(length * (1 - 1e-12))]
    assert early[0] == pytest.approx(p1, abs=1e-9 * scale)
    assert early[1] == pytest.approx(v1, abs=1e-8 * scale)
    if order == 2:
        assert early[2] == pytest.approx(a1, abs=1e-7 * scale / length)
    times = np.linspace(0, length, 9)[1:-1]
    h = 1e-5 * length
    before, now, after = (trajectory.sample(times + d) for d in (-h, 0.0, h))
    assert (after[0] - before[0]) / (2 * h) == pytest.approx(now[1], abs=1e-5 * scale)
    assert (after[1] - before[1]) / (2 * h) == pytest.approx(now[2], abs=1e-5 * scale / length)


def dense():
    rng = np.random.default_rng(3)
    times = np.arange(501) * 0.001
    return JointTrajectory.of_arrays(("a", "b", "c"), times, *rng.normal(size=(3, 501, 3)))


def test_points_come_back_bit_by_bit_all_at_once_and_one_by_one():
    trajectory = dense()
    for got, want in zip(
        trajectory.sample(trajectory.times),
        (trajectory.positions, trajectory.velocities, trajectory.accelerations),
        strict=True,
    ):
        assert np.array_equal(got, want)
    for k in (0, 1, 250, 499, 500):
        p, v, a = trajectory.sample(trajectory.times[k])
        assert np.array_equal(p, trajectory.positions[k])
        assert np.array_equal(v, trajectory.velocities[k])
        assert np.array_equal(a, trajectory.accelerations[k])


def test_arrays_of_times_agree_with_single_times():
    trajectory = dense()
    times = np.random.default_rng(5).uniform(0.0, 0.6, 40)
    together = trajectory.sample(times)
    for k, time in enumerate(times):
        for array, single in zip(together, trajectory.sample(time), strict=True):
            assert np.array_equal(array[k], single)
    assert trajectory.sample(0.1)[0].shape == (3,)
    assert together[0].shape == (40, 3)


def test_sampling_does_not_hand_out_the_trajectory_itself():
    trajectory = dense()
    trajectory.sample(trajectory.times)[0][:] = 7.0
    assert not (trajectory.positions == 7.0).all()
    with pytest.raises(ValueError, match="read-only"):
        trajectory.positions[0, 0] = 1.0


def arrays(**changes):
    fields = {"names": ("a", "b"), "times": [0.0, 1.0], "positions": [[0, 0], [1, 1]]} | changes
    return JointTrajectory.of_arrays(**{k: v if k == "names" else np.array(v, dtype=float) for k, v in fields.items()})


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"positions": [[0, 0], [1, math.nan]]}, "position of joint 'b' at point 1 is nan"),
        ({"velocities": [[0, math.inf], [0, 0]]}, "velocity of joint 'b' at point 0 is inf"),
        ({"times": [0.0, 0.0]}, "point 1 is at 0 s, not later than point 0"),
        ({"times": [1.0, 0.5]}, "not later"),
        ({"times": [-0.1, 0.5]}, "not negative"),
        ({"times": [0.0, math.nan]}, "finite"),
        ({"times": [0.0, 1.0, 2.0]}, r"positions have the shape \(2, 2\); expected \(3, 2\)"),
        ({"velocities": [[0.0, 0.0]]}, "velocities have the shape"),
        ({"accelerations": [[0, 0], [0, 0]]}, "accelerations but no velocities"),
        ({"names": ("a", "a")}, "duplicate joint 'a'"),
        ({"names": ()}, "has no joint names"),
        ({"times": [], "positions": np.zeros((0, 2))}, "no points"),
    ],
)
def test_what_cannot_be_followed_is_refused(changes, text):
    with pytest.raises(InvalidArgument, match=text) as caught:
        arrays(**changes)
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, ManipcliError)
    assert len(caught.value.findings) == 1


@pytest.mark.parametrize(
    ("points", "text"),
    [
        ([], "no points"),
        ([TrajectoryPoint(positions=[])], "point 0 has 0 positions; expected 2"),
        ([TrajectoryPoint(positions=[1, 2, 3])], "point 0 has 3 positions; expected 2"),
        ([TrajectoryPoint(positions=[1, 2], velocities=[1])], "point 0 has 1 velocities; expected 2"),
        ([TrajectoryPoint(positions=[1, 2], accelerations=[1, 1])], "accelerations but no velocities"),
        ([TrajectoryPoint(positions=[1, 2], effort=[1])], "point 0 has 1 efforts; expected 2"),
        ([TrajectoryPoint(velocities=[1])], "point 0 has 1 velocities; expected 2"),
    ],
)
def test_points_of_the_wrong_length_are_refused(points, text):
    with pytest.raises(InvalidArgument, match=text):
        JointTrajectory(("a", "b"), points)


def test_a_straight_line_ends_at_rest_and_a_curve_as_its_point_says():
    line = one_joint(at(0, 0), at(1, 1))
    assert values(line, 1.0) == pytest.approx((1, 0, 0))
    assert values(line, 1.0 - 1e-9)[1] == pytest.approx(1.0)
    assert values(one_joint(at(0, 0, 0), at(1, 1, 2.0)), 1.0)[1] == 2.0


@pytest.mark.parametrize(
    "time", [1.5, {"secs": 1, "nsecs": 500000000}, {"sec": 1, "nanosec": 500000000}, timedelta(seconds=1.5)]
)
def test_points_may_be_mappings_as_messages_in_yaml_are(time):
    point = {"positions": [3.0], "velocities": [], "time_from_start": time}
    assert values(JointTrajectory(["a"], [point], [0.0]), 0.75) == pytest.approx((1.5, 2.0, 0.0))


def test_durations_of_both_ros_are_read():
    for duration in (SimpleNamespace(secs=2, nsecs=5000000), SimpleNamespace(sec=2, nanosec=5000000)):
        assert one_joint(at(1, duration)).duration == pytest.approx(2.005)
    assert one_joint({"positions": 1.0, "time_from_start": {"secs": 3}}).duration == 3.0


@pytest.mark.parametrize(
    ("names", "points", "text"),
    [
        ("ab", [at([1, 1], 1)], "the joint names are a string, 'ab'; expected a list"),
        ([], [at([], 1)], "the trajectory has no joint names"),
        (["a"], at(1, 1), "the points are TrajectoryPoint; expected a list"),
        (["a"], [3.0], "point 0 is 3.0; expected a TrajectoryPoint"),
        (["a"], [{"position": [1]}], "point 0 has an unknown field 'position'"),
        (["a"], [{"positions": [1], "time_from_start": 0}, {"positions": [1]}], "point 1 has no time_from_start"),
        (["a"], [{"positions": [1]}], "point 0 has no time_from_start"),
        (["a"], [at(1, None)], "point 0 has the time_from_start None; expected seconds"),
        (["a"], [at(1, {"secs": "3"})], "time_from_start {'secs': '3'}; expected seconds"),
        (["a"], [{"positions": "x", "time_from_start": 1}], "point 0 has positions that are not numbers: 'x'"),
    ],
)
def test_what_is_no_point_is_told_as_such(names, points, text):
    with pytest.raises(InvalidArgument, match=text):
        JointTrajectory(names, points)
