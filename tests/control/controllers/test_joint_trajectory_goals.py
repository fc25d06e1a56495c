"""Goals of the trajectory controller: starts, stops, speeds, tolerances of rates, and what `compat` changes."""

import math

import numpy as np
import pytest

from manipcli.control import (
    ConstraintsSpec,
    ErrorCode,
    GainsSpec,
    GoalRejected,
    JointConstraintSpec,
    JointState,
    JointTolerance,
    JointTrajectory,
    JointTrajectoryController,
    TrajectoryGoal,
    TrajectoryPoint,
)
from manipcli.core.errors import InvalidArgument
from manipcli.description.elements import JointLimits

PERIOD = 0.01


def made(*interfaces, constraints=None, gains=None, **more):
    """A controller of one joint `j`."""
    return JointTrajectoryController(
        name="arm",
        joints=("j",),
        command_interfaces=interfaces or ("position",),
        constraints=constraints or ConstraintsSpec(stopped_velocity_tolerance=0.0),
        gains={"j": gains or GainsSpec(p=1.0)},
        **more,
    )


def to(*points, names=("j",)):
    return JointTrajectory(names, points)


def at(position, time, velocity=None, acceleration=None, effort=None):
    def one(value):
        return None if value is None else [value]

    return TrajectoryPoint(one(position), time, one(velocity), one(acceleration), one(effort))


def state(position=0.0, velocity=0.0):
    return JointState(np.array([position]), np.array([velocity]), np.zeros(1))


def run(controller, ticks, *, first=0, measured=None, ideal=False):
    """Ticks from `first` on; rows of time, reference, velocity, command. Ideal joints are where the reference is."""
    rows = []
    now = measured or state()
    for k in range(first, first + ticks):
        output = controller.update(k * PERIOD, PERIOD, now)
        rows.append((k * PERIOD, output.position[0], output.velocity[0], output.command[0]))
        if ideal:
            now = state(output.command[0], output.velocity[0])
    return np.array(rows)


def stopped(controller, *, velocity=1.0):
    """A controller that cruises at `velocity` and is canceled at 0.5 s: what it then follows."""
    run(controller, 1)
    handle = controller.send_goal(to(at(10 * velocity, 10.0)))
    run(controller, 50, first=1)
    handle.cancel()
    return run(controller, 200, first=51)


def test_a_cancel_brakes_with_the_deceleration_of_each_joint():
    """Stop distance v^2 / (2 a)."""
    constraints = ConstraintsSpec(joints={"j": JointConstraintSpec(max_deceleration_on_cancel=2.0)})
    rows = stopped(made(constraints=constraints))
    assert rows[-1, 1] - rows[0, 1] == pytest.approx(1.0 / (2 * 2.0))
    assert np.diff(rows[:50, 2]) / PERIOD == pytest.approx(-2.0)
    assert not rows[51:, 2].any()


def test_a_cancel_without_deceleration_holds_where_the_reference_is():
    constraints = ConstraintsSpec(decelerate_on_cancel=False)
    rows = stopped(made(constraints=constraints, limits=[JointLimits(acceleration=1.0)]))
    assert np.ptp(rows[:, 1]) == 0.0
    assert not rows[:, 2].any()
    assert rows[0, 1] == pytest.approx(0.5)


@pytest.mark.parametrize(("begin", "velocity", "end"), [(0.9, -0.03, 0.89625), (1.68, 3.7, 2.1425)])
def test_a_cancel_within_a_given_time_stops_as_in_ros1(begin, velocity, end):
    controller = made(stop_trajectory_duration=0.2)
    run(controller, 1, measured=state(begin - velocity * 0.5))
    handle = controller.send_goal(to(at(begin + velocity * 0.5, 1.0)))
    run(controller, 50, first=1)  # the goal began at 0.01 s: at 0.51 s it is halfway
    handle.cancel()
    rows = run(controller, 40, first=51)
    assert rows[0, 1] == pytest.approx(begin)
    assert rows[0, 2] == pytest.approx(velocity)
    assert rows[-1, 1] == pytest.approx(end)
    assert not rows[21:, 2].any()


@pytest.mark.parametrize(("compat", "goes_on"), [(None, False), ("ros2", False), ("ros1", True)])
def test_after_an_abort_ros1_goes_on_and_others_hold_what_is_measured(compat, goes_on):
    constraints = ConstraintsSpec(joints={"j": JointConstraintSpec(trajectory=0.1)})
    controller = made(constraints=constraints, compat=compat)
    run(controller, 1)
    handle = controller.send_goal(to(at(1.0, 1.0)))
    rows = run(controller, 120, first=1)
    assert handle.result.code is ErrorCode.PATH_TOLERANCE_VIOLATED
    assert handle.result.time == pytest.approx(0.12)
    assert rows[-1, 3] == pytest.approx(1.0 if goes_on else 0.0)
    assert rows[:, 1].max() == pytest.approx(1.0 if goes_on else 0.1)


@pytest.mark.parametrize(("compat", "ends"), [(None, True), ("ros1", True), ("ros2", False)])
def test_a_goal_time_of_zero_is_no_grace_but_endless_in_ros2(compat, ends):
    constraints = ConstraintsSpec(goal_time=0.0, joints={"j": JointConstraintSpec(goal=0.1)})
    controller = made(constraints=constraints, compat=compat)
    handle = controller.send_goal(to(at(1.0, 0.1)))
    run(controller, 1000)
    assert handle.active != ends
    if ends:
        assert handle.result.code is ErrorCode.GOAL_TOLERANCE_VIOLATED
        assert handle.result.time == pytest.approx(0.11)


@pytest.mark.parametrize(
    ("compat", "status", "code"),
    [(None, "aborted", ErrorCode.INVALID_GOAL), ("ros2", "aborted", ErrorCode.INVALID_GOAL),
     ("ros1", "canceled", ErrorCode.SUCCESSFUL)],
)  # fmt: skip
def test_what_becomes_of_a_goal_that_is_preempted(compat, status, code):
    controller = made(compat=compat)
    first = controller.send_goal(to(at(1.0, 1.0)))
    run(controller, 5)
    controller.send_goal(to(at(2.0, 1.0)))
    assert (first.status, first.result.code) == (status, code)


@pytest.mark.parametrize("compat", [None, "ros2", "ros1"])
def test_the_order_of_integration_is_that_of_the_pid(compat):
    controller = made("effort", gains=GainsSpec(i=10.0), compat=compat)
    run(controller, 1)
    controller.send_goal(to(at(1.0, 0.0)))
    rows = run(controller, 2, first=1)
    assert rows[:, 3] == pytest.approx([0.1, 0.2] if compat == "ros1" else [0.0, 0.1])


def test_ros1_antiwindup_is_a_word_of_ros1():
    gains = GainsSpec(i=1.0, i_clamp=0.05, antiwindup=True)
    for compat, ticks in (("ros1", 10), (None, 10)):
        controller = made("effort", gains=gains, compat=compat)
        run(controller, 1)
        controller.send_goal(to(at(1.0, 0.0)))
        run(controller, 100, first=1)  # winds up for a second, behind the clamp
        assert run(controller, 1, first=101)[0, 3] == pytest.approx(0.05)
        rows = run(controller, ticks, first=102, measured=state(2.0))
        assert rows[-1, 3] == pytest.approx(-0.05, abs=0.011)


def test_a_goal_starts_from_the_reference_or_from_what_is_measured():
    for desired, first in ((True, 0.0), (False, 0.3)):
        controller = made(interpolate_from_desired_state=desired)
        run(controller, 1)
        controller.send_goal(to(at(1.0, 1.0)))
        rows = run(controller, 100, first=1, measured=state(0.3))
        assert rows[0, 1] == first
        assert rows[50, 1] == pytest.approx(first + 0.5 * (1.0 - first))


def test_points_that_are_past_are_left_out():
    """A start time in the past: the reference leads in to the first point that is still to come."""
    controller = made()
    run(controller, 50)
    goal = to(at(100.0, 0.1), at(200.0, 0.4), at(1.0, 0.7), at(2.0, 1.2))
    handle = controller.send_goal(TrajectoryGoal(goal, start_time=0.0 + PERIOD))
    rows = run(controller, 80, first=50, ideal=True)
    assert rows[:, 1].max() == pytest.approx(2.0)
    assert np.interp([0.71, 1.21], rows[:, 0], rows[:, 1]) == pytest.approx([1.0, 2.0])
    assert handle.status == "succeeded"
    with pytest.raises(GoalRejected, match=r"ends at t = 1.210 s, 0.08") as refused:
        controller.send_goal(TrajectoryGoal(goal, start_time=0.0 + PERIOD))
    assert refused.value.error_code is ErrorCode.INVALID_GOAL


@pytest.mark.parametrize("start_time", [-1.0, math.nan])
def test_a_start_time_is_a_time(start_time):
    with pytest.raises(GoalRejected, match="start time"):
        made().send_goal(TrajectoryGoal(to(at(1.0, 1.0)), start_time=start_time))


def test_velocities_and_accelerations_of_a_goal_have_tolerances():
    goal = to(at(0.0, 0.0, 0.0), at(1.0, 1.0, 0.0))
    for tolerance, text in (
        (JointTolerance("j", velocity=1.0), "path velocity tolerance: velocity error +1."),
        (JointTolerance("j", acceleration=5.5), "path acceleration tolerance: acceleration error +5."),
    ):
        controller = made()
        run(controller, 1)
        handle = controller.send_goal(TrajectoryGoal(goal, path_tolerance=(tolerance,)))
        run(controller, 100, first=1)
        assert handle.result.code is ErrorCode.PATH_TOLERANCE_VIOLATED
        assert f"joint 'j' exceeds its {text}" in handle.result.text
    # The frozen joint misses 1.5 rad/s (3 (t - t^2) 2) at most, and 6 rad/s2 at the start.
    controller = made()
    run(controller, 1)
    wide = (JointTolerance("j", velocity=1.51, acceleration=6.01),)
    handle = controller.send_goal(TrajectoryGoal(goal, path_tolerance=wide))
    run(controller, 105, first=1)
    assert handle.status == "succeeded"


def test_a_velocity_tolerance_at_the_goal():
    constraints = ConstraintsSpec(goal_time=0.05, stopped_velocity_tolerance=0.1)
    controller = made(constraints=constraints)
    handle = controller.send_goal(to(at(0.0, 0.05)))
    run(controller, 20, measured=state(0.0, 0.2))
    assert "stopped velocity tolerance: velocity error -0.2 rad/s, limit 0.1 rad/s" in handle.result.text
    loose = TrajectoryGoal(to(at(0.0, 0.05)), goal_tolerance=(JointTolerance("j", velocity=0.3),))
    handle = controller.send_goal(loose)
    run(controller, 20, first=20, measured=state(0.0, 0.2))
    assert handle.status == "succeeded"


@pytest.mark.parametrize(("limit", "status"), [(1.9, "aborted"), (2.1, "succeeded"), (-1.0, "succeeded")])
def test_an_acceleration_tolerance_at_the_goal(limit, status):
    """After the end the joint's velocity grows by 2 rad/s2, while its place is that of the goal."""
    controller = made(constraints=ConstraintsSpec(goal_time=0.05, stopped_velocity_tolerance=0.0))
    goal = TrajectoryGoal(to(at(0.0, 0.05)), goal_tolerance=(JointTolerance("j", acceleration=limit),))
    handle = controller.send_goal(goal)
    for k in range(20):
        controller.update(k * PERIOD, PERIOD, state(0.0, 2.0 * k * PERIOD))
    assert handle.status == status
    if status == "aborted":
        assert "goal acceleration tolerance: acceleration error -2 rad/s^2, limit 1.9 rad/s^2" in handle.result.text
    else:
        assert handle.result.time == pytest.approx(0.05)


def test_an_acceleration_at_the_goal_is_waited_for():
    """At its first tick nobody knows it; a joint that has come to rest reaches its goal at the next."""
    controller = made(constraints=ConstraintsSpec(goal_time=0.1, stopped_velocity_tolerance=0.0))
    tolerance = (JointTolerance("j", acceleration=0.5),)
    run(controller, 1)
    at_once = controller.send_goal(TrajectoryGoal(to(at(0.0, 0.0)), goal_tolerance=tolerance))
    run(controller, 1, first=1)
    assert at_once.active
    run(controller, 1, first=2)
    assert at_once.status == "succeeded"


def test_efforts_of_points_go_to_the_command():
    """Linear between the points, a period ahead; the last one stays."""
    points = [at(0.0, 0.0, effort=0.0), at(0.0, 1.0, effort=10.0)]
    controller = made("effort")
    run(controller, 1)
    controller.send_goal(to(*points))
    rows = run(controller, 150, first=1)
    assert rows[:, 3] == pytest.approx(np.minimum(10.0 * (rows[:, 0] - 0.01 + PERIOD), 10.0))

    controller = made("position", "effort", feed_forward="gravity")
    run(controller, 1)
    controller.send_goal(to(*points))
    run(controller, 50, first=1)
    assert controller.output.commands[1] == pytest.approx([5.0])
    controller.output.commands[1][:] += 7.0  # as the manager adds gravity, which must not add up
    run(controller, 1, first=51)
    assert controller.output.commands[1] == pytest.approx([5.1])


def test_without_interpolation_the_command_steps_to_the_next_point():
    controller = made(interpolation_method="none")
    run(controller, 1)
    controller.send_goal(to(at(1.0, 0.1), at(2.0, 0.2)))
    rows = run(controller, 30, first=1)
    assert rows[:10, 1].tolist() == [0.0] * 10
    assert rows[11:, 1].tolist() == [2.0] * 19


def test_upsampled_points_are_followed_without_a_step_of_velocity():
    steps = []
    for smooth in (False, True):
        controller = made(positions_upsampling=smooth)
        run(controller, 1)
        controller.send_goal(to(at(0.1, 0.1), at(0.3, 0.2), at(0.4, 0.4)))
        steps.append(np.abs(np.diff(run(controller, 60, first=1)[:, 2])).max())
    assert steps[0] > 0.9
    assert steps[1] < 0.45


def test_the_reference_is_exact_between_ticks_and_at_any_period():
    """A quintic from 0 to 1 within 1 s, looked at with another period than that with which it began."""
    goal = to(at(0.0, 0.0, 0.0, 0.0), at(1.0, 1.0, 0.0, 0.0))
    regular, odd = made(), made()
    for controller in (regular, odd):
        controller.send_goal(goal)
        run(controller, 1)
    s = 0.0
    for step in (0.0031, 0.01, 0.0007, 0.25, 0.3):
        s += step
        output = odd.update(s, step, state())
        p = 10 * s**3 - 15 * s**4 + 6 * s**5
        assert output.position[0] == pytest.approx(p, abs=1e-12)
        assert output.velocity[0] == pytest.approx(30 * s**2 - 60 * s**3 + 30 * s**4, abs=1e-12)
    assert regular.update(s, PERIOD, state()).position[0] == pytest.approx(p, abs=1e-12)


def test_speed_scales_the_reference_as_time_does():
    """dq/dt = f q'(s), d2q/dt2 = f^2 q''(s), and no jump where the speed changes."""
    controller = made("velocity", gains=GainsSpec(ff_velocity_scale=1.0))
    run(controller, 1)
    controller.send_goal(to(at(1.0, 1.0, 0.0, 0.0)))
    run(controller, 31, first=1)  # s = 0.3
    controller.scaling.set(0.5, at_once=True)
    whole = JointTrajectory(["j"], [at(1.0, 1.0, 0.0, 0.0)], at(0.0, 0.0, 0.0, 0.0))
    for k in range(32, 60):
        s = 0.3 + 0.5 * (k - 31) * PERIOD
        output = controller.update(k * PERIOD, PERIOD, state())
        p, v, a = whole.sample(s)
        assert output.position == pytest.approx(p)
        assert output.velocity == pytest.approx(0.5 * v)
        assert output.acceleration == pytest.approx(0.25 * a)
        assert output.command == pytest.approx(0.5 * whole.sample(s + 0.5 * PERIOD)[1])


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_a_goal_that_replaces_another_begins_with_its_velocity_and_acceleration_at_any_speed(speed):
    """Real ones: as those of a controller whose goal is not replaced."""
    new, same = made("position", "velocity", "acceleration"), made("position", "velocity", "acceleration")
    for controller in (new, same):
        run(controller, 1)
        controller.scaling.set(speed, at_once=True)
        controller.send_goal(to(at(1.0, 1.0, 0.0, 0.0)))
        run(controller, 20, first=1)
    new.send_goal(to(at(2.0, 1.0, 0.0, 0.0)))
    replaced, going_on = (controller.update(21 * PERIOD, PERIOD, state()) for controller in (new, same))
    assert abs(going_on.acceleration[0]) > 0.5
    np.testing.assert_allclose(replaced.rows[:3], going_on.rows[:3])


def test_after_a_cancel_no_error_changes_the_way_to_rest():
    """The path tolerance was that of the goal."""
    joints = {"j": JointConstraintSpec(trajectory=0.1, max_deceleration_on_cancel=2.0)}
    controller = made(constraints=ConstraintsSpec(joints=joints))
    run(controller, 1)
    handle = controller.send_goal(to(at(10.0, 10.0)))
    run(controller, 9, first=1)
    handle.cancel()
    rows = run(controller, 100, first=10, measured=state(-3.0))
    assert rows[-1, 1] - rows[0, 1] == pytest.approx(1.0 / (2 * 2.0))
    assert np.diff(rows[:50, 2]) / PERIOD == pytest.approx(-2.0)
    assert (handle.status, handle.result.code) == ("canceled", ErrorCode.SUCCESSFUL)


def test_a_continuous_joint_goes_the_short_way_beside_others_that_do_not():
    """In a goal of all joints, and in one that leaves some out."""
    joints, there = ("j", "wheel", "k"), {"j": 3.0, "wheel": -3.1, "k": 3.0}
    for names in (joints, joints[:2]):
        controller = JointTrajectoryController(
            name="arm", joints=joints, command_interfaces=("position",), allow_partial_joints_goal=True,
            types=["revolute", "continuous", "revolute"],
        )  # fmt: skip
        now = JointState(np.array([-3.1, 3.1, -3.1]), np.zeros(3), np.zeros(3))
        controller.update(0.0, PERIOD, now)
        handle = controller.send_goal(to(TrajectoryPoint([there[name] for name in names], 0.1), names=names))
        for k in range(1, 12):
            output = controller.update(k * PERIOD, PERIOD, now)
        held = 3.0 if "k" in names else -3.1
        assert output.position == pytest.approx([3.0, 2 * math.pi - 3.1, held])
        now = JointState(np.array([3.0, -3.1, held]), np.zeros(3), np.zeros(3))
        controller.update(12 * PERIOD, PERIOD, now)
        assert handle.feedback().error == pytest.approx([0.0, 0.0, 0.0])


def test_feedback_tells_the_next_point_and_both_states():
    controller = made()
    run(controller, 1)
    handle = controller.send_goal(to(at(1.0, 0.1), at(2.0, 0.2), at(3.0, 0.3)))
    seen = []
    for k in range(1, 35):
        controller.update(k * PERIOD, PERIOD, state(0.25, 0.5))
        seen.append(handle.feedback().index)
    assert sorted(set(seen)) == [0, 1, 2]
    assert [seen.index(k) for k in (0, 1, 2)] == [0, 10, 20]
    feedback = handle.feedback()
    assert feedback.elapsed == pytest.approx(0.33)
    assert feedback.desired == pytest.approx([3.0])
    assert feedback.actual == pytest.approx([0.25])
    assert feedback.error == pytest.approx([2.75])
    assert feedback.actual_velocity == pytest.approx([0.5])


def test_a_continuous_joint_has_its_feedback_in_the_turn_of_the_reference():
    controller = made(types=["continuous"])
    run(controller, 1, measured=state(3.1))
    handle = controller.send_goal(to(at(-3.1, 0.1)))
    run(controller, 12, first=1, measured=state(-3.0))
    assert handle.feedback().error == pytest.approx([-0.1])
    assert handle.feedback().desired == pytest.approx([2 * math.pi - 3.1])


@pytest.mark.parametrize(("position", "velocity"), [(math.nan, 0.0), (math.inf, 0.0), (0.0, math.nan)])
def test_what_is_measured_must_be_a_number(position, velocity):
    for interface in ("position", "effort"):
        controller = made(interface)
        run(controller, 1)
        with pytest.raises(InvalidArgument, match=r"measured .* of joint 'j' is"):
            controller.update(PERIOD, PERIOD, state(position, velocity))


@pytest.mark.parametrize("period", [0.0, -0.1, math.nan, math.inf])
def test_a_period_is_a_time_at_every_tick(period):
    controller = made()
    run(controller, 2)  # it holds
    with pytest.raises(InvalidArgument, match=r"a period of .* s; expected more than 0"):
        controller.update(2 * PERIOD, period, state())


@pytest.mark.parametrize(
    "wrong", [{"cmd_timeout": -1.0}, {"stop_trajectory_duration": math.nan}, {"speed_scaling": -0.1}]
)
def test_times_and_speeds_are_not_negative(wrong):
    with pytest.raises(InvalidArgument, match=next(iter(wrong))):
        made(**wrong)


def test_two_runs_are_equal():
    def whole():
        controller = made("effort", gains=GainsSpec(p=3.0, i=1.0, d=0.5, u_clamp_min=-2, u_clamp_max=2))
        run(controller, 1)
        controller.send_goal(to(at(1.0, 0.3), at(-1.0, 0.9)))
        rows = [run(controller, 40, first=1)]
        controller.scaling.set(0.7, at_once=True)
        controller.send_goal(TrajectoryGoal(to(at(0.5, 0.5)), start_time=0.6))
        rows.append(run(controller, 120, first=41))
        return np.vstack(rows)

    assert np.array_equal(whole(), whole())


def quick(**more):
    """A controller whose joint may move at 1 rad/s, and rests at 0."""
    controller = made(limits=[JointLimits(-6.0, 6.0, velocity=1.0)], **more)
    run(controller, 1)
    return controller


@pytest.mark.parametrize("velocity", [None, 0.0])
def test_a_first_point_that_is_too_far_away_is_refused_like_any_other(velocity):
    """From 0 at rest 0.9 rad in 0.1 s are 9 rad/s, whatever the curve."""
    with pytest.raises(GoalRejected, match=r"'j' moves at 9 rad/s on the path to point 0; its limit is 1 rad/s"):
        quick().send_goal(to(at(0.9, 0.1, velocity)))
    with pytest.raises(GoalRejected, match=r"moves at -2 rad/s on the path to point 0"):
        quick().send_goal(TrajectoryGoal(to(at(-1.0, 0.5), at(0.0, 2.0)), start_time=3.0))
    with pytest.raises(GoalRejected, match=r"moves at -1.5708 rad/s on the path to point 0"):  # the shortest way
        quick(types=["continuous"]).send_goal(to(at(1.5 * math.pi, 1.0), at(1.5 * math.pi + 0.1, 2.0)))


@pytest.mark.parametrize(
    "goal",
    [
        to(at(0.1, 0.1 * (1 - 1e-6))),  # rounded
        to(at(1e-7, 1e-9), at(0.0, 1.0)),
        to(at(0.9, 0.0)),  # wanted as a step
        to(at(-0.2, 0.001), at(0.0, 1.0)),  # where the joint is measured
        TrajectoryGoal(to(at(0.005, 0.0051), at(0.0, 1.0)), start_time=PERIOD / 2),  # past, but it was in reach
        JointTrajectory(["j"], [at(0.9, 0.1)], interpolation="none"),
    ],
)
def test_a_first_point_is_not_refused_for_rounding_or_where_the_joint_is(goal):
    controller = quick()
    run(controller, 1, first=1, measured=state(-0.2))
    assert controller.send_goal(goal).active


def test_a_first_point_is_reached_from_where_the_reference_will_be():
    """It moves at its limit: from 0.5 at 0.5 s, 0.51 one tick later, 1 rad at its end."""
    for start_time, point, legal in (
        (0.0, at(0.6, 0.1), True), (0.0, at(0.61, 0.1), True), (0.0, at(0.62, 0.1), False), (0.8, at(0.9, 0.1), True),
        (0.8, at(0.6, 0.1), False), (2.0, at(1.1, 0.1), True), (2.0, at(0.5, 0.1), False),
    ):  # fmt: skip
        controller = quick()
        controller.send_goal(to(at(1.0, 1.0)))
        run(controller, 51, first=1, measured=state(5.0))
        goal = TrajectoryGoal(to(point, at(1.0, 3.0)), start_time=start_time + (PERIOD if start_time else 0.0))
        if legal:
            assert controller.send_goal(goal).active
        else:
            with pytest.raises(GoalRejected, match="on the path to point 0"):
                controller.send_goal(goal)


@pytest.mark.parametrize("points", [[at(0.9, 0.52)], [at(0.8, 0.4), at(0.9, 0.52)], [at(0.8, 0.4), at(0.9, 0.505)]])
@pytest.mark.parametrize("replaces", [True, False])
def test_of_a_goal_in_the_past_only_the_time_that_is_left_counts(points, replaces):
    """At rest at 0 at 0.5 s: nothing brings a joint of 1 rad/s to 0.9 rad by 0.52 s, whenever the goal began."""
    controller = quick(allow_trajectory_replacement=replaces)
    run(controller, 50, first=1)
    with pytest.raises(GoalRejected, match=rf"'j' moves at 90 rad/s on the path to point {len(points) - 1}"):
        controller.send_goal(TrajectoryGoal(to(*points), start_time=1e-9))
    assert controller.send_goal(TrajectoryGoal(to(at(0.8, 0.4), at(0.9, 1.5)), start_time=1e-9)).active


def test_a_goal_before_the_controller_is_active_is_not_asked_for_its_way():
    assert made(limits=[JointLimits(velocity=1.0)]).send_goal(to(at(0.9, 0.1))).active


@pytest.mark.parametrize("begins", ["now", "from the start"])
def test_a_goal_that_replaces_a_paused_trajectory_starts_at_rest_and_goes_on_with_the_clock(begins):
    controller = made("position", "velocity")
    if begins == "now":
        controller.send_goal(TrajectoryGoal(to(at(1.0, 1.0))))
        run(controller, 50)
    controller.scaling.set(0.0, at_once=True)
    first = run(controller, 2, first=50)
    controller.send_goal(TrajectoryGoal(to(at(2.0, 1.0, velocity=0.0, acceleration=0.0))))
    paused = run(controller, 10, first=52)
    np.testing.assert_array_equal(paused[:, 1], first[-1][1])
    np.testing.assert_array_equal(paused[:, 2], 0.0)
    controller.scaling.set(1.0, at_once=True)
    after = run(controller, 110, first=62)
    assert np.isfinite(after).all()
    assert after[-1][1] == pytest.approx(2.0)
