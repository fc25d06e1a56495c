"""The PID law: sequences worked out by hand, the order of integration in ROS 1 and 2, arrays against single joints."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.control.pid import Pid
from manipcli.core.errors import InvalidArgument


def run(pid, errors, dt=1.0):
    steps = [dt] * len(errors) if np.isscalar(dt) else dt
    return [pid.update(e, h) for e, h in zip(errors, steps, strict=True)]


def test_proportional():
    """Conformance 14: P = 1 repeats the error."""
    assert run(Pid(p=1.0), [-0.5, -1.0, 0.5]) == [-0.5, -1.0, 0.5]


def test_integral_acts_one_step_late_and_in_ros1_at_once():
    """Conformance 15: ROS 2 integrates after it commands (forward Euler), ROS 1 before."""
    errors = [-0.5, -0.5, 0.0, 0.0, 1.0, 0.0]
    assert run(Pid(i=1.0, u_min=-5, u_max=5), errors) == pytest.approx([0, -0.5, -1, -1, -1, 0])
    assert run(Pid(i=1.0, u_min=-5, u_max=5, compat="ros1"), errors[:5]) == pytest.approx([-0.5, -1, -1, -1, 0])


def test_derivative_of_the_error():
    """Conformance 16: the first derivative of ROS 2 is taken from 0; ROS 1 waits for a second error."""
    out = run(Pid(d=1.0), [-0.5, -0.5, -0.5, -1.0, -0.5], [1, 1, 0.1, 1, 1])
    assert out == pytest.approx([-0.5, 0, 0, -0.5, 0.5])
    assert run(Pid(d=1.0, compat="ros1"), [-0.5, -1.0]) == pytest.approx([0, -0.5])
    assert Pid(d=2.0).update(0.0, 1e-3, error_rate=3.0) == 6.0


def test_all_terms():
    """Conformance 17: the three terms add up."""
    assert run(Pid(p=1.0, i=1.0, d=1.0), [-0.5, -0.5, 0.0]) == pytest.approx([-1, -1, -0.5])


def test_command_is_clamped_only_where_asked():
    """Conformance 18: an output clamp of 1, its mirror, and none."""
    for sign in (1, -1):
        errors = [sign * e for e in (0.5, 1.0, 2.0, 100.0)]
        assert run(Pid(p=1.0, u_min=-1, u_max=1), errors) == [sign * u for u in (0.5, 1, 1, 1)]
        assert run(Pid(p=1.0), errors) == errors


def test_back_calculation_with_a_clamped_integral():
    """Conformance 21: the clamp of the integral holds beside back calculation."""
    pid = Pid(i=2.0, i_min=-1, i_max=1, antiwindup="back_calculation", tracking_time=1.0)
    assert run(pid, [-1.0, -1.0, 0.5, 0.0]) == pytest.approx([0, -1, -1, 0])


def test_back_calculation_unwinds_by_what_was_cut():
    pid = Pid(i=1.0, u_min=-1, u_max=1, antiwindup="back_calculation", tracking_time=2.0)
    # I: 0, +10; then cut by 9: 10 + 10 - 9/2 = 15.5; then cut by 14.5: 15.5 + 10 - 7.25 = 18.25
    run(pid, [10.0, 10.0, 10.0])
    assert pid.i_term == pytest.approx([18.25])


def test_conditional_integration_stops_while_pushing_into_the_clamp():
    pid = Pid(p=1.0, i=1.0, u_min=-1, u_max=1, antiwindup="conditional_integration")
    run(pid, [5.0, 5.0])
    assert pid.i_term == pytest.approx([0.0])
    run(pid, [0.5])
    assert pid.i_term == pytest.approx([0.5])


def test_ros1_windup_with_and_without_its_antiwindup():
    """Conformance 23: ROS 1 winds up behind the clamp of the term, unless its antiwindup is true."""
    errors = [10.0, 10.0, -1.0, -1.0]
    clamp = {"i": 1.0, "i_min": -1, "i_max": 1, "compat": "ros1"}
    assert run(Pid(**clamp), errors) == [1, 1, 1, 1]
    assert run(Pid(**clamp, antiwindup="conditional_integration"), errors) == [1, 1, 0, -1]
    assert run(Pid(**clamp), [-10.03, 30.0]) == [-1, 1]


@pytest.mark.parametrize("compat", ["ros1", "ros2"])
def test_an_integral_clamp_of_zero_means_no_integral(compat):
    """Conformance 24: ROS 1's default clamp of 0 leaves P alone."""
    assert run(Pid(p=1.0, i=1.0, i_min=0, i_max=0, compat=compat), [1.0, 1.0]) == [1, 1]


def test_a_frozen_integral_stays_whatever_is_cut():
    """And goes on, as one that never stood still, once it is let go."""
    pid = Pid(i=[1.0] * 3, u_min=-1, u_max=1, antiwindup=["back_calculation"] * 2 + ["none"], tracking_time=2.0)
    run(pid, [np.full(3, 2.0)] * 2)
    before = pid.i_term
    pid.freeze([True, False, True])
    pid.update(np.full(3, 2.0), 1.0)
    np.testing.assert_array_equal(pid.i_term[[0, 2]], before[[0, 2]])
    assert pid.i_term[1] == before[1] + 2.0 + (1.0 - before[1]) / 2.0
    pid.freeze(False)
    pid.update(np.full(3, 2.0), 1.0)
    assert pid.i_term[0] == before[0] + 2.0 + (1.0 - before[0]) / 2.0


def test_back_calculation_without_integral_gain_does_nothing():
    """Conformance 25: without an integral gain no tracking time is chosen, and nothing is integrated."""
    pid = Pid(u_min=-1, u_max=1, antiwindup="back_calculation")
    assert run(pid, [-1.0] * 3 + [10.0] * 3) == [0] * 6
    assert pid.tracking_time == pytest.approx([0.0])
    assert pid.i_term == pytest.approx([0.0])


def test_tracking_time_is_chosen_from_the_gains():
    assert Pid(p=2.0, i=4.0, d=9.0).tracking_time == pytest.approx([1.5])
    assert Pid(p=2.0, i=4.0).tracking_time == pytest.approx([0.5])
    assert Pid(p=2.0, i=4.0, tracking_time=3.0).tracking_time == pytest.approx([3.0])


def test_reset_forgets_the_integral_unless_told():
    """Conformance 26: reset, with and without the integral."""
    pid = Pid(i=1.0)
    assert run(pid, [-0.5, 0.0]) == [0, -0.5]
    pid.reset(keep_integral=True)
    assert pid.update(0.0, 1.0) == -0.5
    pid.reset()
    assert run(pid, [0.5, 0.5]) == [0, 0.5]


def test_time_that_stands_still_repeats_and_time_that_runs_back_is_refused():
    """Conformance 26: dt of 0 repeats the command, a negative dt is an error."""
    pid = Pid(p=2.0, i=1.0)
    assert pid.update(1.0, 1.0) == 2.0
    assert pid.update(7.0, 0.0) == 2.0
    assert pid.i_term == pytest.approx([1.0])
    for dt in (-1.0, math.nan):
        with pytest.raises(InvalidArgument, match="dt is"):
            pid.update(1.0, dt)


@pytest.mark.parametrize("compat", ["ros1", "ros2"])
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_an_error_that_is_no_number_gives_nan_and_keeps_the_state(compat, bad):
    """Conformance 26: NaN gives NaN and leaves the integral alone."""
    pid = Pid(p=[1.0, 1.0], i=[1.0, 1.0], d=[0.0, 1.0], compat=compat)
    pid.update(np.array([1.0, 1.0]), 1.0)
    before = pid.i_term
    out = pid.update(np.array([bad, 1.0]), 1.0)
    assert math.isnan(out[0])
    assert math.isfinite(out[1])
    assert pid.i_term[0] == before[0]
    assert pid.i_term[1] == before[1] + 1.0
    scalar = Pid(p=1.0, compat=compat)
    assert math.isnan(scalar.update(bad, 1.0))
    assert scalar.update(1.0, 1.0) == 1.0


@pytest.mark.parametrize(
    "bad",
    [
        {"u_min": 1, "u_max": -1},
        {"u_min": 1, "u_max": 1},
        {"i_min": 0.1},
        {"i_max": -0.1},
        {"tracking_time": -1},
        {"error_deadband": -1e-3},
        {"p": math.nan},
        {"i": math.inf},
    ],
)
def test_impossible_gains_are_refused_and_the_old_ones_stay(bad):
    """Conformance 27: bounds that cross are refused by the constructor and by set_gains."""
    with pytest.raises(InvalidArgument):
        Pid(**{"p": 1.0, **bad})
    pid = Pid(p=2.0, u_min=-1, u_max=1)
    with pytest.raises(ValueError, match=r"."):
        pid.set_gains(**{"p": 9.0, **bad})
    assert [pid.update(0.1, 1.0), pid.update(5.0, 1.0)] == [0.2, 1.0]


@pytest.mark.parametrize("compat", ["ros1", "ros2"])
@pytest.mark.parametrize("antiwindup", ["none", "conditional_integration"])
def test_many_joints_are_as_many_single_ones(compat, antiwindup):
    rng = np.random.default_rng(1)
    gains = dict(zip("pid", rng.uniform(0.1, 3.0, (3, 5)), strict=True))
    bounds = {
        "u_min": -rng.uniform(0.5, 2, 5),
        "u_max": rng.uniform(0.5, 2, 5),
        "i_min": -np.ones(5),
        "i_max": np.ones(5),
    }
    together = Pid(**gains, **bounds, antiwindup=antiwindup, compat=compat)
    single = [
        Pid(**{k: float(v[j]) for k, v in (gains | bounds).items()}, antiwindup=antiwindup, compat=compat)
        for j in range(5)
    ]
    for _ in range(30):
        error = rng.normal(size=5)
        assert together.update(error, 0.1) == pytest.approx([single[j].update(error[j], 0.1) for j in range(5)])


def test_a_new_command_does_not_change_the_last_and_errors_are_not_touched():
    pid = Pid(p=[1.0, 2.0], i=[1.0, 1.0], d=[1.0, 1.0])
    error = np.array([1.0, 2.0])
    first = pid.update(error, 0.1)
    kept = first.copy()
    pid.update(-error, 0.1)
    assert np.array_equal(first, kept)
    assert np.array_equal(error, [1.0, 2.0])
    with pytest.raises(InvalidArgument, match="2 joints"):
        pid.update(np.zeros(3), 0.1)


@pytest.mark.parametrize("compat", ["ros1", "ros2"])
def test_errors_inside_the_deadband_are_not_integrated(compat):
    pid = Pid(i=1.0, error_deadband=0.1, compat=compat)
    run(pid, [0.1, -0.05, 0.1])
    assert pid.i_term == pytest.approx([0.0])
    run(pid, [0.2])
    assert pid.i_term == pytest.approx([0.2])


@pytest.mark.parametrize("compat", ["ros1", "ros2"])
@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=8), st.floats(0.0, 0.8))
def test_opposite_errors_are_commanded_the_opposite(compat, errors, deadband):
    """The deadband, too, has two sides."""
    one, other = (Pid(p=2.0, i=3.0, d=0.5, error_deadband=deadband, compat=compat) for _ in range(2))
    assert run(one, errors) == pytest.approx([-u for u in run(other, [-e for e in errors])])
    assert one.i_term == pytest.approx(-other.i_term)
    assert one.i_term == pytest.approx([3.0 * sum(e for e in errors if abs(e) > deadband)])


def test_a_change_of_gain_makes_no_step():
    pid = Pid(i=1.0)
    run(pid, [1.0, 1.0])
    pid.set_gains(i=50.0)
    assert pid.update(0.0, 1.0) == 2.0


def test_each_joint_has_its_own_antiwindup():
    words = ("none", "back_calculation", "conditional_integration")
    gains = {"p": 1.0, "i": 1.0, "u_min": -1.0, "u_max": 1.0, "tracking_time": 2.0}
    together = Pid(**{k: [v] * 3 for k, v in gains.items()}, antiwindup=words)
    single = [Pid(**gains, antiwindup=word) for word in words]
    for error in (5.0, 3.0, -0.5, -4.0, 0.2):
        assert together.update(np.full(3, error), 0.5) == pytest.approx([pid.update(error, 0.5) for pid in single])
    with pytest.raises(InvalidArgument, match="2 anti-windup values"):
        Pid(p=[1.0] * 3, antiwindup=("none", "none"))


@pytest.mark.parametrize("compat", ["ros1", "ros2"])
def test_in_place_it_is_the_same_law(compat):
    gains = {"p": [2.0, 1.0], "i": [3.0, 0.0], "d": [0.5, 0.1], "u_min": [-1.0, -9.0], "u_max": [1.0, 9.0]}
    one, other = Pid(**gains, compat=compat), Pid(**gains, compat=compat)
    rng = np.random.default_rng(2)
    command = np.empty(2)
    for _ in range(20):
        errors = rng.normal(size=(2, 2))
        other.apply(errors, 0.01, command)
        assert np.array_equal(command, one.update(errors[0], 0.01, errors[1]))


def test_gains_may_stand_in_their_order_and_errors_be_arrays_of_one():
    pid = Pid(2.0, 1.0, 0.5)
    assert pid.update(np.array([1.0]), 1.0) == 2.5
    assert pid.update(np.array(1.0), 1.0) == 3.0
    with pytest.raises(InvalidArgument, match=r"error of shape \(2,\) for gains of 1 joints"):
        pid.update(np.array([1.0, 1.0]), 1.0)
    with pytest.raises(InvalidArgument, match="unknown anti-windup 'True'; expected 'none'"):
        Pid(antiwindup=True)
