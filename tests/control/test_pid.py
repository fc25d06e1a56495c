"""The PID law: sequences worked out by hand, the order of integration in ROS 1 and 2, arrays against single joints."""

import math

import numpy as np
import pytest

from manipcli.control.pid import Pid
from manipcli.core.errors import InvalidArgument


def run(pid, errors, dt=1.0):
    steps = [dt] * len(errors) if np.isscalar(dt) else dt
    return [pid.update(e, h) for e, h in zip(errors, steps, strict=True)]


def test_proportional():
    assert run(Pid(p=1.0), [-0.5, -1.0, 0.5]) == [-0.5, -1.0, 0.5]


def test_integral_acts_one_step_late_and_in_ros1_at_once():
    errors = [-0.5, -0.5, 0.0, 0.0, 1.0, 0.0]
    assert run(Pid(i=1.0, u_min=-5, u_max=5), errors) == pytest.approx([0, -0.5, -1, -1, -1, 0])
    assert run(Pid(i=1.0, u_min=-5, u_max=5, compat="ros1"), errors[:5]) == pytest.approx([-0.5, -1, -1, -1, 0])


def test_derivative_of_the_error():
    out = run(Pid(d=1.0), [-0.5, -0.5, -0.5, -1.0, -0.5], [1, 1, 0.1, 1, 1])
    assert out == pytest.approx([-0.5, 0, 0, -0.5, 0.5])
    assert run(Pid(d=1.0, compat="ros1"), [-0.5, -1.0]) == pytest.approx([0, -0.5])
    assert Pid(d=2.0).update(0.0, 1e-3, error_rate=3.0) == 6.0


def test_all_terms():
    assert run(Pid(p=1.0, i=1.0, d=1.0), [-0.5, -0.5, 0.0]) == pytest.approx([-1, -1, -0.5])


def test_command_is_clamped_only_where_asked():
    for sign in (1, -1):
        errors = [sign * e for e in (0.5, 1.0, 2.0, 100.0)]
        assert run(Pid(p=1.0, u_min=-1, u_max=1), errors) == [sign * u for u in (0.5, 1, 1, 1)]
        assert run(Pid(p=1.0), errors) == errors


def test_back_calculation_with_a_clamped_integral():
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
    errors = [10.0, 10.0, -1.0, -1.0]
    clamp = {"i": 1.0, "i_min": -1, "i_max": 1, "compat": "ros1"}
    assert run(Pid(**clamp), errors) == [1, 1, 1, 1]
    assert run(Pid(**clamp, antiwindup="conditional_integration"), errors) == [1, 1, 0, -1]
    assert run(Pid(**clamp), [-10.03, 30.0]) == [-1, 1]


@pytest.mark.parametrize("compat", ["ros1", "ros2"])
def test_an_integral_clamp_of_zero_means_no_integral(compat):
    assert run(Pid(p=1.0, i=1.0, i_min=0, i_max=0, compat=compat), [1.0, 1.0]) == [1, 1]


def test_back_calculation_without_integral_gain_does_nothing():
    pid = Pid(u_min=-1, u_max=1, antiwindup="back_calculation")
    assert run(pid, [-1.0] * 3 + [10.0] * 3) == [0] * 6
    assert pid.tracking_time == pytest.approx([0.0])
    assert pid.i_term == pytest.approx([0.0])


def test_tracking_time_is_chosen_from_the_gains():
    assert Pid(p=2.0, i=4.0, d=9.0).tracking_time == pytest.approx([1.5])
    assert Pid(p=2.0, i=4.0).tracking_time == pytest.approx([0.5])
    assert Pid(p=2.0, i=4.0, tracking_time=3.0).tracking_time == pytest.approx([3.0])


def test_reset_forgets_the_integral_unless_told():
    pid = Pid(i=1.0)
    assert run(pid, [-0.5, 0.0]) == [0, -0.5]
    pid.reset(keep_integral=True)
    assert pid.update(0.0, 1.0) == -0.5
    pid.reset()
    assert run(pid, [0.5, 0.5]) == [0, 0.5]


def test_time_that_stands_still_repeats_and_time_that_runs_back_is_refused():
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
        {"p": math.nan},
        {"i": math.inf},
    ],
)
def test_impossible_gains_are_refused_and_the_old_ones_stay(bad):
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
