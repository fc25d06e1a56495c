"""Joint limits as pure functions: the numbers of ros2_control and ros_control, and what must hold for all numbers."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.control import limit_acceleration, limit_effort, limit_position, limit_velocity
from manipcli.control.limit_laws import refuse_limits
from manipcli.core.errors import InvalidArgument

PI = math.pi


def test_position_is_clamped_to_its_limits_and_to_its_speed():
    """Case 51 (ros2_control, period 1 s): limits -+ pi, then a velocity limit of 1 from the command before."""
    hard = {"lower": -PI, "upper": PI, "dt": 1.0}
    assert [limit_position(c, previous=0.0, **hard) for c in (4.0, -5.0, 0.0)] == [PI, -PI, 0.0]
    assert limit_position(2.0, previous=0.0, velocity=1.0, **hard) == 1.0
    assert limit_position(-3.0, previous=1.0, velocity=1.0, **hard) == 0.0
    assert limit_position(-PI, position=2.0, velocity=1.0, **hard) == 1.0  # no command before: the measured 2.0


def test_a_position_command_gains_no_more_speed_than_the_acceleration_allows():
    """ros2_control: a step of at most min(v_max, |v measured| + a dt) dt."""
    limits = {"velocity": 2.0, "acceleration": 5.0, "previous": 0.0, "dt": 0.1}
    assert limit_position(9.0, measured_velocity=0.0, **limits) == pytest.approx(0.05)
    assert limit_position(9.0, measured_velocity=-1.0, **limits) == pytest.approx(0.15)
    assert limit_position(9.0, measured_velocity=1.9, **limits) == pytest.approx(0.2)


@pytest.mark.parametrize(("beyond", "refused"), [(0.008, False), (0.009, True)])
def test_a_position_measured_far_beyond_its_limits_is_refused(beyond, refused):
    """ros2_control throws beyond 0.0087 rad."""
    measured = [0.0, -1.0 - beyond]
    if not refused:
        assert limit_position([0.0, -3.0], lower=-1.0, upper=1.0, position=measured, dt=1.0).tolist() == [0.0, -1.0]
        return
    with pytest.raises(InvalidArgument, match=r"joint 1 is measured at -1.009"):
        limit_position([0.0, 0.0], lower=-1.0, upper=1.0, position=measured, dt=1.0)


def test_a_velocity_limit_on_positions_needs_where_it_starts():
    with pytest.raises(InvalidArgument, match="needs `previous`"):
        limit_position(1.0, velocity=1.0, dt=1.0)
    assert limit_position(3.0, lower=-1.0, upper=2.0, dt=1.0) == 2.0


def test_time_is_asked_for_only_where_something_changes_with_it():
    assert limit_position(3.0, lower=-1.0, upper=2.0) == 2.0
    assert limit_velocity(3.0, velocity=2.0) == 2.0
    for limited in (
        lambda dt: limit_position(1.0, velocity=1.0, previous=0.0, dt=dt),
        lambda dt: limit_position(1.0, previous=0.0, soft_upper=0.5, k_position=2.0, dt=dt),
        lambda dt: limit_velocity(1.0, acceleration=1.0, previous=0.0, dt=dt),
        lambda dt: limit_velocity(1.0, upper=1.0, position=0.0, dt=dt),
    ):
        with pytest.raises(InvalidArgument, match="`dt`"):
            limited(None)
        for wrong in (0.0, -1.0, math.nan):
            with pytest.raises(InvalidArgument, match="expected a time above 0"):
                limited(wrong)


@pytest.mark.parametrize("wrong", [-1.0, math.nan, [1.0, -0.5], [math.nan, 1.0]])
@pytest.mark.parametrize("name", ["velocity", "acceleration", "deceleration", "effort", "k_position", "k_velocity"])
def test_a_limit_below_nothing_is_refused(name, wrong):
    with pytest.raises(InvalidArgument, match=f"the limit `{name}` is .*; expected 0 or more"):
        refuse_limits(**{name: wrong})
    refuse_limits(**{name: [0.0, math.inf]})


@pytest.mark.parametrize("ends", [(1.0, -1.0), (math.nan, 1.0), (0.0, math.nan), ([0.0, 1.0], [1.0, 0.5])])
def test_a_lower_limit_above_the_upper_one_is_refused(ends):
    with pytest.raises(InvalidArgument, match="expected each lower limit at or below its upper"):
        refuse_limits(*ends)
    refuse_limits([0.0, -math.inf], [0.0, math.inf])


def test_soft_limits_of_positions():
    """Case 54 (ros_control's PositionJointSoftLimits): dt 0.1, v_max 2, soft 0.8 with k 20, hard 1."""
    law = {"lower": -1.0, "upper": 1.0, "velocity": 2.0, "k_position": 20.0, "dt": 0.1}
    soft = {**law, "soft_lower": -0.8, "soft_upper": 0.8}
    assert limit_position(0.4, previous=0.0, **soft) == pytest.approx(0.2)  # v_max dt
    assert limit_position(-0.4, previous=0.0, **soft) == pytest.approx(-0.2)
    for further in (0.8, 0.9, 5.0):
        assert limit_position(further, previous=0.8, **soft) == pytest.approx(0.8)  # at the soft limit, no further
    assert limit_position(0.75, previous=0.8, **soft) == pytest.approx(0.75)  # but back
    led_back = limit_position(0.9, previous=0.9, **soft)
    assert led_back == pytest.approx(0.7)  # k times 0.1 is v_max, towards the inside
    beyond_hard = {**law, "soft_lower": -9.0, "soft_upper": 9.0}
    assert limit_position(5.0, previous=0.95, **beyond_hard) == 1.0  # a soft limit beyond the hard one: the hard one


def test_a_soft_limit_is_approached_ever_slower_and_not_passed():
    """q' = k (soft - q): after the speed limit ends, the distance shrinks by 1 - k dt a tick."""
    q, steps = 0.0, []
    for _ in range(200):
        before, q = q, float(
            limit_position(9.0, previous=q, velocity=2.0, soft_upper=0.8, soft_lower=-0.8, k_position=20.0, dt=0.01)
        )  # fmt: skip
        steps.append(q - before)
    assert max(steps) == pytest.approx(0.02)
    assert q == pytest.approx(0.8)
    near = [s for s in steps if 1e-12 < s < 0.0199]
    np.testing.assert_allclose(np.array(near[1:]) / np.array(near[:-1]), 0.8, rtol=1e-3)


def test_velocity_is_clamped_and_cannot_run_past_a_position_limit():
    """ros2_control (period 1 s, limits -+5, v_max 1): by (limit - position) / dt; at the limit, 0."""
    limits = {"velocity": 1.0, "lower": -5.0, "upper": 5.0, "dt": 1.0}
    for position, command, expected in [
        (None, 2.0, 1.0), (None, -math.inf, -1.0), (None, 0.12, 0.12),
        (4.5, 5.0, 0.5), (4.8, 5.0, 0.2), (4.5, 0.3, 0.3), (4.5, 0.5, 0.5), (5.0, 0.9, 0.0), (4.3, 5.0, 0.7),
        (-4.8, -6.0, -0.2), (-3.0, -5.0, -1.0), (-4.5, -0.2, -0.2), (-5.0, -3.0, 0.0),
    ]:  # fmt: skip
        assert limit_velocity(command, position=position, **limits) == pytest.approx(expected)


def test_a_joint_just_beyond_its_limit_may_come_back_and_one_far_beyond_stands():
    """ros2_control: up to 0.002 beyond, inwards only; further, 0. `beyond="return"` lets it come back from anywhere."""
    limits = {"velocity": 1.0, "lower": -5.0, "upper": 5.0, "dt": 1.0}
    for command, near, far, back in [(3.0, 0.0, 0.0, 0.0), (-2.0, -1.0, 0.0, -1.0), (-0.2, -0.2, 0.0, -0.2)]:
        assert limit_velocity(command, position=5.001, **limits) == near
        assert limit_velocity(command, position=5.004, **limits) == far
        assert limit_velocity(command, position=5.004, beyond="return", **limits) == back
        assert limit_velocity(-command, position=-5.001, **limits) == -near
        assert limit_velocity(-command, position=-5.004, **limits) == far


def test_velocity_changes_no_faster_than_the_acceleration_allows():
    """ros2_control (period 1 s, v_max 1, a 0.5), one command after the other."""
    before = 0.0
    for command, expected in [
        (1.0, 0.5), (1.0, 1.0), (-0.2, 0.5), (-0.2, 0.0), (-0.2, -0.2), (-0.9, -0.7), (-2.0, -1.0), (2.0, -0.5),
        (2.0, 0.0), (2.0, 0.5), (2.0, 1.0), (0.0, 0.5), (0.0, 0.0),
    ]:  # fmt: skip
        before = float(limit_velocity(command, velocity=1.0, acceleration=0.5, previous=before, dt=1.0))
        assert before == pytest.approx(expected)


def test_ros1_velocity_reverses_within_its_acceleration():
    """Case 54 (ros_control): a = v_max / dt; from +v/2, -2 v ends at -v/2."""
    v, dt = 2.0, 0.1
    assert limit_velocity(-2 * v, velocity=v, acceleration=v / dt, previous=v / 2, dt=dt) == pytest.approx(-v / 2)


def test_where_a_position_limit_asks_for_more_braking_than_there_is_the_joint_brakes_as_it_can():
    """ros2_control (period 1 s): at -4.8 with -1 before, 0.5 of change and 0.2 of way: -0.5."""
    limits = {"velocity": 1.0, "acceleration": 0.5, "lower": -5.0, "upper": 5.0, "dt": 1.0}
    assert limit_velocity(-2.0, position=-4.8, previous=-1.0, **limits) == pytest.approx(-0.5)
    assert limit_velocity(-1.0, position=-4.8, previous=-0.5, **limits) == pytest.approx(-0.2)


def test_soft_limits_of_velocities():
    """ros_control's VelocityJointSoftLimits: v <= k (soft - q), negative beyond it."""
    law = {"velocity": 2.0, "k_position": 20.0, "soft_lower": -0.8, "soft_upper": 0.8, "dt": 0.001}
    assert limit_velocity(2.0, position=0.75, **law) == pytest.approx(1.0)
    assert limit_velocity(2.0, position=0.8, **law) == 0.0
    assert limit_velocity(2.0, position=0.85, **law) == pytest.approx(-1.0)
    assert limit_velocity(-2.0, position=0.85, **law) == -2.0
    assert limit_velocity(-2.0, position=-0.79, **law) == pytest.approx(-0.2)


def test_an_effort_of_400_at_a_limit_of_200_is_200():
    """Case 62."""
    assert limit_effort(400.0, effort=200.0) == 200.0
    assert limit_effort([400.0, -400.0, 20.0], effort=200.0).tolist() == [200.0, -200.0, 20.0]


def test_an_effort_never_pushes_further_out():
    """ros2_control (limits -+5, v_max 1, effort 200): blocked at a limit unless the joint is on its way back."""
    limits = {"effort": 200.0, "lower": -5.0, "upper": 5.0, "max_velocity": 1.0}
    for position, velocity, command, expected in [
        (4.0, 0.4, 201.0, 200.0), (4.0, -0.2, -201.0, -200.0), (4.0, 0.4, 20.0, 20.0),
        (5.0, 0.0, 20.0, 0.0), (6.0, 0.0, 400.0, 0.0), (5.0, 0.0, -20.0, -20.0), (6.0, 0.0, -400.0, -200.0),
        (5.0, -0.2, 400.0, 200.0), (5.0, -0.2, 30.0, 30.0), (5.0, 0.2, 30.0, 0.0), (5.0, 0.2, -400.0, -200.0),
        (-5.0, 0.2, -20.0, -20.0), (-5.0, 0.2, 400.0, 200.0), (-5.0, -0.2, -30.0, 0.0), (-5.0, -0.2, 30.0, 30.0),
        (0.0, 1.1, 30.0, 0.0), (0.0, 1.1, -30.0, -30.0), (0.0, -1.1, -30.0, 0.0), (0.0, 1.0, 30.0, 30.0),
    ]:  # fmt: skip
        assert limit_effort(command, position=position, velocity=velocity, **limits) == expected


def test_soft_limits_of_efforts():
    """ros_control's EffortJointSoftLimits: effort <= -k_v (v - v_max(q)), within -+ effort."""
    law = {"effort": 10.0, "max_velocity": 2.0, "soft_lower": -0.8, "soft_upper": 0.8, "k_position": 20.0}
    with_velocity = {**law, "k_velocity": 50.0}
    assert limit_effort(9.0, position=0.0, velocity=0.0, **with_velocity) == 9.0
    assert limit_effort(9.0, position=0.0, velocity=1.9, **with_velocity) == pytest.approx(5.0)  # 50 (2 - 1.9)
    assert limit_effort(9.0, position=0.79, velocity=0.1, **with_velocity) == pytest.approx(5.0)  # 50 (0.2 - 0.1)
    assert limit_effort(9.0, position=0.8, velocity=0.0, **with_velocity) == 0.0
    assert limit_effort(9.0, position=0.81, velocity=0.0, **with_velocity) == pytest.approx(-10.0)  # led back
    assert limit_effort(-9.0, position=-0.81, velocity=0.0, **with_velocity) == pytest.approx(10.0)
    assert limit_effort(9.0, position=0.8, velocity=0.0, **law) == 9.0  # without k_velocity, no bound on efforts
    velocity_only = {"effort": 10.0, "max_velocity": 2.0, "k_velocity": 50.0}
    assert limit_effort(9.0, position=0.0, velocity=1.9, **velocity_only) == pytest.approx(5.0)


def test_accelerations_and_decelerations():
    """ros2_control: 0.5 to speed up, 0.25 to slow down, where the velocity is known."""
    both = {"acceleration": 0.5, "deceleration": 0.25}
    for velocity, command, expected in [
        (None, 0.6, 0.5), (None, -1.5, -0.5), (0.4, 0.8, 0.5), (-0.4, -0.6, -0.5), (0.4, -0.6, -0.25),
        (-0.4, 3.0, 0.25), (0.4, -0.1, -0.1),
    ]:  # fmt: skip
        assert limit_acceleration(command, velocity=velocity, **both) == expected


finite = st.floats(-20.0, 20.0)


@given(finite, st.floats(-5.0, 5.0), finite, st.booleans())
def test_what_was_limited_once_stays_as_it_is(command, position, other, soft):
    """Limiting is idempotent, keeps within the hard limits, and never makes a command larger than it was."""
    law = {"soft_lower": -4.0, "soft_upper": 4.0, "k_position": 3.0} if soft else {}
    once = limit_velocity(command, velocity=2.0, position=position, lower=-5.0, upper=5.0, dt=0.1, **law)
    assert limit_velocity(once, velocity=2.0, position=position, lower=-5.0, upper=5.0, dt=0.1, **law) == once
    assert abs(once) <= 2.0
    assert -5.0 - 1e-12 <= position + once * 0.1 <= 5.0 + 1e-12
    effort = {"effort": 7.0, "position": position, "velocity": other, "lower": -5.0, "upper": 5.0, "max_velocity": 9.0}
    stiff = {**law, "k_velocity": 2.0} if soft else {}
    limited = limit_effort(command, **effort, **stiff)
    assert abs(limited) <= 7.0
    assert limit_effort(limited, **effort, **stiff) == limited
    if not soft:
        assert abs(once) <= abs(command)
        assert limited * command >= 0.0
        assert abs(limited) <= abs(command)
