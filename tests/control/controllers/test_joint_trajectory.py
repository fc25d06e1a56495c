"""The trajectory controller driven by hand: frozen joints, ideal joints, and a double integrator under PD."""

import math

import numpy as np
import pytest

from manipcli.control.action import ErrorCode, GoalRejected
from manipcli.control.controller import JointState
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.core.errors import InvalidArgument
from manipcli.description.elements import JointLimits
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint
from manipcli.spec.controllers import ConstraintsSpec, GainsSpec, JointConstraintSpec

JOINTS = ("joint1", "joint2", "joint3")
START = np.array([1.1, 2.1, 3.1])
PERIOD = 0.001


def state(position, velocity=None):
    position = np.array(position, dtype=float)
    velocity = np.zeros_like(position) if velocity is None else np.array(velocity, dtype=float)
    return JointState(position=position, velocity=velocity, effort=np.zeros_like(position))


def make(interface="position", joints=JOINTS, *, path=None, goal=None, goal_time=2.0, stopped=0.0, **more):
    constraints = ConstraintsSpec(
        goal_time=goal_time,
        stopped_velocity_tolerance=stopped,
        joints={j: JointConstraintSpec(trajectory=path, goal=goal) for j in joints},
    )
    more.setdefault("gains", {} if interface == "position" else {j: GainsSpec(p=1.0) for j in joints})
    return JointTrajectoryController(
        name="arm", joints=joints, command_interfaces=(interface,), constraints=constraints, **more
    )


def point(positions, time, velocities=None, accelerations=None):
    return TrajectoryPoint(
        positions=positions, time_from_start=time, velocities=velocities, accelerations=accelerations
    )


def trajectory(*points, names=JOINTS):
    return JointTrajectory(names, points)


def run(controller, measured, ticks, *, first=0):
    """Ticks with joints that never move; the last output."""
    for k in range(first, first + ticks):
        output = controller.update(k * PERIOD, PERIOD, measured)
    return output


def test_activation_holds_the_measured_position():
    for interface in ("position", "velocity", "effort"):
        output = make(interface).update(0.0, PERIOD, state(START))
        assert np.array_equal(output.position, START)
        assert not output.velocity.any()
        assert np.array_equal(output.command, START if interface == "position" else np.zeros(3))


def test_it_keeps_holding_where_it_was_activated_while_the_joint_drifts():
    controller = make("effort", gains={j: GainsSpec(p=10.0, d=2.0) for j in JOINTS})
    controller.update(0.0, PERIOD, state(START))
    output = controller.update(PERIOD, PERIOD, state(START + 0.1, [0.5, 0.0, 0.0]))
    assert output.command == pytest.approx([-1.0 - 1.0, -1.0, -1.0])


def test_a_joint_that_does_not_move_breaks_the_path_tolerance_and_is_held_where_it_is():
    controller = make(path=1e-4)
    handle = controller.send_goal(trajectory(point([4, 5, 6], 0.0)))
    output = controller.update(0.0, PERIOD, state(START))
    assert (handle.status, handle.result.code) == ("aborted", ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert np.array_equal(output.command, START)
    assert not output.velocity.any()


def test_the_abort_names_joint_value_limit_and_time():
    controller = make(path=0.0105, types=["revolute", "prismatic", "revolute"])
    controller.update(0.0, PERIOD, state(START))
    handle = controller.send_goal(trajectory(point([1.1, 2.2, 3.1], 0.1)))
    run(controller, state(START), 20, first=1)
    assert handle.result.code is ErrorCode.PATH_TOLERANCE_VIOLATED
    for part in ("arm", "joint2", "+0.011 m", "limit 0.0105 m", "0.012 s"):
        assert part in handle.result.text
    assert handle.result.time == pytest.approx(0.012)


def test_frozen_joints_break_the_goal_tolerance_after_goal_time_and_are_held():
    controller = make(goal=0.1, goal_time=1e-6)
    controller.update(0.0, PERIOD, state(START))
    handle = controller.send_goal(trajectory(point([4, 5, 6], 0.01)))
    output = run(controller, state(START), 15, first=1)
    assert (handle.status, handle.result.code) == ("aborted", ErrorCode.GOAL_TOLERANCE_VIOLATED)
    assert np.array_equal(output.command, START)
    assert "joint" in handle.result.text
    assert "limit 0.1 rad" in handle.result.text


@pytest.mark.parametrize(("goal_time", "ticks"), [(0.0, 10), (0.005, 15)])
def test_goal_time_is_the_grace_after_the_end(goal_time, ticks):
    controller = make(goal=0.1, goal_time=goal_time + 1e-9 if goal_time else 0.0)
    handle = controller.send_goal(trajectory(point([4, 5, 6], 0.01)))
    run(controller, state(START), ticks + (1 if goal_time else 0))
    assert handle.active
    run(controller, state(START), 1, first=ticks + (1 if goal_time else 0))
    # The first tick outside at the end is allowed no grace at 0, and `goal_time` of it otherwise.
    if goal_time:
        assert handle.result.code is ErrorCode.GOAL_TOLERANCE_VIOLATED
    else:
        run(controller, state(START), 1, first=ticks + 1)
        assert handle.result.code is ErrorCode.GOAL_TOLERANCE_VIOLATED


def test_success_needs_all_joints_inside_and_slow_at_the_same_tick():
    controller = make(goal=0.01, stopped=0.1)
    handle = controller.send_goal(trajectory(point([0, 0, 0], 0.0)))
    for k, (q, v) in enumerate([([0, 0, 0.1], [0, 0, 0]), ([0, 0.1, 0], [0, 0, 0]), ([0, 0, 0], [0, 0.2, 0])]):
        controller.update(k * PERIOD, PERIOD, state(q, v))
        assert handle.active
    controller.update(3 * PERIOD, PERIOD, state([0.005, 0, 0], [0.05, 0, 0]))
    assert (handle.status, handle.result.code) == ("succeeded", ErrorCode.SUCCESSFUL)


def test_it_never_succeeds_before_its_end():
    controller = make(goal=3.0)
    handle = controller.send_goal(trajectory(point(START, 0.01)))
    run(controller, state(START), 10)
    assert handle.active
    run(controller, state(START), 1, first=10)
    assert handle.status == "succeeded"


def test_the_first_sample_is_checked_even_when_it_is_the_only_one():
    controller = make(path=0.1, goal_time=100.0, goal=0.01)
    handle = controller.send_goal(trajectory(point(START + 1.0, 0.0)))
    controller.update(0.0, PERIOD, state(START))
    assert handle.result.code is ErrorCode.PATH_TOLERANCE_VIOLATED


def test_jumbled_names_give_each_joint_its_own_value():
    controller = make(goal_time=1e9, goal=1e-3)
    controller.send_goal(trajectory(point([2, 1, 3], 0.0), names=("joint2", "joint1", "joint3")))
    assert run(controller, state(START), 3).command.tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("make_trajectory", "text"),
    [
        (lambda: trajectory(point([1, 1, 1], 1.0), names=("joint1", "joint2", "bad_name")), "bad_name"),
        (lambda: trajectory(point([1, 1], 1.0), names=("joint1", "joint2")), "no values for joint 'joint3'"),
        (lambda: trajectory(point([1, 1, 1], 1.0, [-1, -2, -3])), "joint3' at -3 rad/s, not at rest"),
        (lambda: trajectory(point([1, 9, 1], 1.0)), "joint2' is at 9 rad at point 0; its limits are -5 to 5"),
        (lambda: trajectory(point([1, 1, 1], 1.0, [0, 4, 0]), point([1, 1, 1], 2.0, [0, 0, 0])), "4 rad/s at point 0"),
        (lambda: trajectory(point([1, 1, 1], 1.0), point([1, 1, 5], 2.0)), "4 rad/s on the path to point 1"),
    ],
)
def test_goals_that_cannot_be_followed_are_refused_and_the_one_before_goes_on(make_trajectory, text):
    controller = make(limits=[JointLimits(-5, 5, 3)] * 3)
    before = controller.send_goal(trajectory(point([1, 1, 1], 1.0)))
    controller.update(0.0, PERIOD, state(START))
    with pytest.raises(InvalidArgument, match=text):
        controller.send_goal(make_trajectory())
    assert before.active


def test_an_end_velocity_is_accepted_where_it_is_allowed():
    controller = make(allow_nonzero_velocity_at_trajectory_end=True)
    assert controller.send_goal(trajectory(point([1, 1, 1], 1.0, [-1, -2, -3]))).active


def test_a_curve_that_swings_over_a_limit_between_its_points_is_aborted_before_it_starts():
    controller = make(limits=[JointLimits(-1, 1)] * 3)
    controller.update(0.0, PERIOD, state([0, 0, 0]))
    swing = trajectory(point([0.9, 0, 0], 0.1, [8, 0, 0]), point([0.9, 0, 0], 0.5, [0, 0, 0]))
    handle = controller.send_goal(swing)
    output = controller.update(PERIOD, PERIOD, state([0, 0, 0]))
    assert (handle.status, handle.result.code) == ("aborted", ErrorCode.INVALID_GOAL)
    assert "joint1" in handle.result.text
    assert not output.command.any()


def test_a_second_goal_preempts_the_first_without_a_jump():
    controller = make("position", goal=1e-3)
    controller.update(0.0, PERIOD, state([0, 0, 0]))
    first = controller.send_goal(trajectory(point([1, 1, 1], 0.5, [0, 0, 0], [0, 0, 0])))
    references = [run(controller, state([0, 0, 0]), 1, first=k).position.copy() for k in range(1, 251)]
    second = controller.send_goal(trajectory(point([0, 0, 0], 0.5, [0, 0, 0], [0, 0, 0])))
    assert first.status == "aborted"
    assert first.result.code is ErrorCode.INVALID_GOAL
    assert "preempted" in first.result.text
    references += [run(controller, state([0, 0, 0]), 1, first=k).position.copy() for k in range(251, 760)]
    assert second.status == "succeeded"
    velocity = np.diff(references, axis=0) / PERIOD
    assert np.abs(np.diff(velocity, axis=0)).max() / PERIOD < 60.0  # [rad/s2]: a jump of velocity would be > 1000
    assert np.allclose(references[-1], 0.0)


def test_cancel_stops_within_the_acceleration_limits_and_holds():
    controller = make(limits=[JointLimits(-5, 5, 3, acceleration=10.0)] * 3)
    controller.update(0.0, PERIOD, state([0, 0, 0]))
    handle = controller.send_goal(trajectory(point([1, 0.5, 0], 1.0, [0, 0, 0])))
    run(controller, state([0, 0, 0]), 500, first=1)
    handle.cancel()
    assert handle.status == "canceled"
    outputs = [run(controller, state([0, 0, 0]), 1, first=k) for k in range(501, 502)]
    velocity = outputs[0].velocity.copy()
    assert velocity == pytest.approx([1.5, 0.75, 0.0], abs=0.01)
    references, rates = [], []
    for k in range(502, 800):
        output = run(controller, state([0, 0, 0]), 1, first=k)
        references.append(output.position.copy())
        rates.append(output.velocity.copy())
    assert np.abs(np.diff(rates, axis=0)).max() / PERIOD <= 10.0 * 1.01
    assert not rates[-1].any()
    assert references[-1][0] == pytest.approx(0.5 + 1.5**2 / (2 * 10.0), abs=2e-3)
    handle.cancel()  # nothing happens to a goal that ended
    assert handle.status == "canceled"


def test_cancel_without_known_accelerations_stops_at_once():
    controller = make()
    controller.update(0.0, PERIOD, state([0, 0, 0]))
    handle = controller.send_goal(trajectory(point([1, 1, 1], 1.0)))
    run(controller, state([0, 0, 0]), 100, first=1)
    handle.cancel()
    first = run(controller, state([0, 0, 0]), 1, first=101).position.copy()
    later = run(controller, state([0, 0, 0]), 1, first=300)
    assert np.array_equal(first, later.position)
    assert not later.velocity.any()


def test_a_goal_can_be_canceled_before_it_began():
    controller = make()
    handle = controller.send_goal(trajectory(point([1, 1, 1], 1.0)))
    handle.cancel()
    assert np.array_equal(run(controller, state(START), 5).command, START)
    assert handle.status == "canceled"


def test_a_goal_that_is_canceled_before_it_began_does_not_leave_the_joints_on_the_path_before():
    controller = make(limits=[JointLimits(-5, 5, 3, acceleration=10.0)] * 3)
    controller.update(0.0, PERIOD, state([0, 0, 0]))
    first = controller.send_goal(trajectory(point([2, 0, 0], 2.0, [0, 0, 0])))
    run(controller, state([0, 0, 0]), 1000, first=1)
    second = controller.send_goal(trajectory(point([-2, 0, 0], 2.0, [0, 0, 0])))
    second.cancel()
    assert (first.status, second.status) == ("aborted", "canceled")
    output = run(controller, state([0, 0, 0]), 1000, first=1001)
    assert not output.velocity.any()
    assert output.position[0] == pytest.approx(1.0 + 1.5**2 / (2 * 10.0), abs=3e-3)  # from 1.5 rad/s at 10 rad/s2


def test_deactivation_aborts_and_the_next_update_holds_anew():
    controller = make()
    controller.update(0.0, PERIOD, state(START))
    handle = controller.send_goal(trajectory(point([1, 1, 1], 1.0)))
    run(controller, state(START), 5, first=1)
    controller.deactivate(0.006)
    assert handle.result.code is ErrorCode.INVALID_GOAL
    assert np.array_equal(controller.update(0.1, PERIOD, state([7, 8, 9])).command, [7, 8, 9])


def test_planned_points_are_the_references_bit_by_bit():
    times = np.arange(301) * PERIOD
    s = times / times[-1]
    blend = (
        10 * s**3 - 15 * s**4 + 6 * s**5,
        (30 * s**2 - 60 * s**3 + 30 * s**4) / 0.3,
        (60 * s - 180 * s**2 + 120 * s**3) / 0.09,
    )
    p, v, a = (np.outer(x, [1.0, -0.5, 0.25]) for x in blend)
    v[-1] = 0.0
    controller = make(path=1e-9, goal=1e-9)
    handle = controller.send_goal(JointTrajectory.of_arrays(JOINTS, times, p, v, a))
    offset = 4000  # far from 0, where k * period rounds
    for k in range(301):
        output = controller.update((offset + k) * PERIOD, PERIOD, state(p[k], v[k]))
        assert np.array_equal(output.position, p[k])
        assert np.array_equal(output.velocity, v[k])
        assert np.array_equal(output.acceleration, a[k])
        assert np.array_equal(output.command, p[min(k + 1, 300)])  # one period ahead
    assert handle.status == "succeeded"
    assert np.array_equal(controller.update(5.0, PERIOD, state(p[-1])).position, p[-1])


def test_it_holds_on_when_the_clock_is_set_back():
    controller = make("position", goal=1e-3)
    handle = controller.send_goal(trajectory(point(START, 0.05), point(START + 0.1, 0.1)))
    for k in range(120):
        output = controller.update(k * PERIOD, PERIOD, state(START + 0.1 if k > 80 else START))
    assert handle.status == "succeeded"
    output = controller.update(0.0, PERIOD, state(START))
    assert output.command == pytest.approx(START + 0.1)


def test_lead_in_begins_at_the_reference_not_at_the_sagging_joint():
    controller = make("effort", gains={j: GainsSpec(p=1.0) for j in JOINTS})
    controller.update(0.0, PERIOD, state([0, 0, 0]))
    controller.send_goal(trajectory(point([1, 1, 1], 1.0)))
    assert np.array_equal(controller.update(PERIOD, PERIOD, state([0.2, 0, 0])).position, [0, 0, 0])


def test_velocity_law_feeds_the_reference_forward():
    controller = make("velocity", gains={j: GainsSpec(p=2.0, ff_velocity_scale=0.5) for j in JOINTS})
    controller.update(0.0, PERIOD, state([0, 0, 0]))
    controller.send_goal(trajectory(point([1, 1, 1], 1.0)))
    output = run(controller, state([0, 0, 0]), 101, first=1)
    assert output.command == pytest.approx(np.full(3, 2.0 * 0.1 + 0.5 * 1.0))


def test_position_passes_the_reference_on():
    assert np.array_equal(make("position").update(0.0, PERIOD, state(START)).command, START)


def test_continuous_joints_take_the_shortest_way():
    controller = make(joints=("wheel", "arm"), types=["continuous", "revolute"], path=0.5, goal=1e-3)
    measured = state([3.0, 3.0])
    controller.update(0.0, PERIOD, measured)
    handle = controller.send_goal(trajectory(point([-3.0, 3.0], 0.1), names=("wheel", "arm")))
    output = run(controller, measured, 101, first=1)
    assert output.position == pytest.approx([2 * math.pi - 3.0, 3.0])
    turned = state([2 * math.pi - 3.0 - 4 * math.pi, 3.0])  # the same angle, two turns away
    controller.update(0.102, PERIOD, turned)
    assert handle.status == "succeeded"


@pytest.mark.parametrize(
    "bad",
    [
        {"joints": ("a", "a")},
        {"joints": ()},
        {"gains": {"other": GainsSpec(p=1.0)}},
        {"command_interfaces": ("effort",), "gains": {}},
        {"command_interfaces": ("velocity",), "gains": {"a": GainsSpec()}},
        {"constraints": ConstraintsSpec(joints={"other": JointConstraintSpec(goal=1.0)})},
    ],
)
def test_a_controller_that_cannot_work_is_refused(bad):
    with pytest.raises(InvalidArgument):
        JointTrajectoryController(**{"name": "c", "joints": ("a",), "command_interfaces": ("position",), **bad})


def test_a_double_integrator_under_pd_tracks_and_arrives():
    inertia, n = 0.5, 2
    gains = {j: GainsSpec(p=400.0, d=30.0) for j in ("a", "b")}
    controller = make("effort", joints=("a", "b"), gains=gains, path=0.05, goal=1e-3, stopped=0.01)
    q, v = np.zeros(n), np.zeros(n)
    rest = [0.0, 0.0]
    controller.update(0.0, PERIOD, state(q))
    handle = controller.send_goal(trajectory(point([1.0, -0.5], 1.0, rest, rest), names=("a", "b")))
    worst = 0.0
    for k in range(1, 1500):
        output = controller.update(k * PERIOD, PERIOD, state(q, v))
        worst = max(worst, float(np.abs(output.position - q).max()))
        v = v + PERIOD * output.command / inertia
        q = q + PERIOD * v
    assert handle.status == "succeeded"
    assert q == pytest.approx([1.0, -0.5], abs=1e-4)
    # The error of a PD law without feed-forward is at most about inertia a_max / kp, a_max = 5.77 rad/s2.
    assert worst < 1.2 * inertia * 5.77 / 400.0
    feedback = handle.feedback()
    assert feedback.error == pytest.approx(feedback.desired - feedback.actual)


def test_one_interface_need_not_stand_in_a_list_nor_gains_be_objects():
    made = JointTrajectoryController(
        name="arm", joints=["a"], command_interfaces="effort", gains={"a": {"p": 2.0, "ff_velocity_scale": 0.0}}
    )
    assert made.interfaces == ("effort",)
    made.update(0.0, PERIOD, state([0.5]))
    assert made.update(PERIOD, PERIOD, state([0.0])).commands[0] == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("goal_time", "told"), [(0.0, "goal_time 0 s: no grace; with `compat: ros2`"), (0.001, "0.001 s)")]
)
def test_who_gives_no_grace_is_told_so(goal_time, told):
    made = make(goal=0.1, goal_time=goal_time)
    made.update(0.0, PERIOD, state(START))
    handle = made.send_goal(JointTrajectory(JOINTS, [point(START + 1.0, 0.002)]))
    for tick in range(1, 8):
        made.update(tick * PERIOD, PERIOD, state(START))
    assert handle.result.code is ErrorCode.GOAL_TOLERANCE_VIOLATED
    assert told in handle.result.text


def test_what_is_no_trajectory_is_no_goal():
    with pytest.raises(GoalRejected, match="the goal is a list; expected a JointTrajectory"):
        make().send_goal([1.0, 2.0, 3.0])
