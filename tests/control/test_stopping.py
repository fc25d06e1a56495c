"""How a trajectory controller comes to rest: laws over random states."""

import numpy as np
import pytest

from manipcli.control.active_trajectory import ACCELERATION, POSITION, VELOCITY
from manipcli.control.controller import JointState
from manipcli.control.stopping import Stopping
from manipcli.control.trajectory_controller import JointTrajectoryController
from manipcli.control.trajectory_goal import JointFacts
from manipcli.description.elements import JointLimits
from manipcli.plan.from_motion import stopped
from manipcli.plan.trajectory import JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec, JointConstraintSpec

PERIOD = 0.001
NAMES = ("a", "b", "c")


def stopping(limits, *, constraints=None, stop_duration=0.0, planner=None):
    facts = JointFacts.of(NAMES[: len(limits)], limits, None)
    return Stopping.of(facts, constraints or ConstraintsSpec(), stop_duration, planner)


def stop(made, position, velocity, acceleration=0.0):
    """(T, 4, n) of the ticks until all rests."""
    row = np.zeros((4, len(position)))
    row[POSITION], row[VELOCITY], row[ACCELERATION] = position, velocity, acceleration
    samples = made.to_rest(row, PERIOD).ticks(PERIOD)
    assert samples[0, POSITION] == pytest.approx(np.array(position))
    assert not samples[-1, VELOCITY].any()
    return samples


def random_limits(rng):
    return [
        JointLimits(lower=-1.0, upper=1.0, velocity=4.0, acceleration=float(a)) for a in 10.0 ** rng.uniform(0, 1.5, 3)
    ]


def test_a_joint_that_can_stop_inside_its_limits_alone_does():
    """From q0 it needs v^2 / (2 a): it never leaves its limits, nor brakes harder than it may; common where inside."""
    rng = np.random.default_rng(4)
    common = alone = 0
    for _ in range(150):
        limits = random_limits(rng)
        acceleration = np.array([limit.acceleration for limit in limits])
        position = rng.uniform(-1, 1, 3)
        room = 1.0 - position
        velocity = np.sqrt(2.0 * acceleration * room) * rng.uniform(0, 1, 3)
        mirror = np.sign(rng.uniform(-1, 1, 3))
        position, velocity = mirror * position, mirror * velocity
        samples = stop(stopping(limits), position, velocity)
        assert np.abs(samples[:, POSITION]).max() <= 1.0 + 1e-6
        assert (np.abs(np.diff(samples[:, VELOCITY], axis=0)) <= acceleration * PERIOD * (1 + 1e-6)).all()
        slowest = (np.abs(velocity) / acceleration).max()
        end = position + 0.5 * velocity * slowest
        if np.abs(end).max() <= 1.0:
            assert samples[-1, POSITION] == pytest.approx(end)
            common += 1
        else:
            assert samples[-1, POSITION] == pytest.approx(position + 0.5 * velocity * np.abs(velocity) / acceleration)
            alone += 1
    assert min(common, alone) > 20


@pytest.mark.parametrize("planner", [None, stopped])
@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("duration", [0.0, 0.3])
def test_no_stop_leaves_the_limits_whatever_the_deceleration(duration, own, planner):
    """Where a joint may not brake as hard as the limit is near, it stops at the limit."""
    rng = np.random.default_rng(5)
    constraints = ConstraintsSpec(joints={"a": JointConstraintSpec(max_deceleration_on_cancel=0.5)} if own else {})
    for _ in range(50):
        position, velocity = rng.uniform(-1, 1, 3), rng.uniform(-4, 4, 3)
        made = stopping(random_limits(rng), constraints=constraints, stop_duration=duration, planner=planner)
        assert np.abs(stop(made, position, velocity)[:, POSITION]).max() <= 1.0 + 1e-6


@pytest.mark.parametrize("planner", [None, stopped])
def test_a_joint_beyond_its_limit_comes_back_but_goes_no_farther(planner):
    limits = [JointLimits(lower=-1.0, upper=1.0, acceleration=1.0)] * 3
    samples = stop(stopping(limits, planner=planner), [1.2, 1.2, 0.0], [0.4, -0.4, 0.4])
    assert samples[:, POSITION, 0].max() == pytest.approx(1.2)
    assert samples[-1, POSITION] == pytest.approx([1.2, 1.2 - 0.08, 0.08])


def test_a_joint_without_limits_needs_none():
    samples = stop(stopping([JointLimits(acceleration=2.0), JointLimits(acceleration=1.0)]), [5.0, 0.0], [2.0, 2.0])
    assert samples[-1, POSITION] == pytest.approx([7.0, 2.0])


def test_where_one_joint_says_a_deceleration_each_stops_by_its_own():
    """v^2 / (2 a): of the others, a is their limit."""
    constraints = ConstraintsSpec(joints={"a": JointConstraintSpec(max_deceleration_on_cancel=0.5)})
    made = stopping([JointLimits(acceleration=4.0)] * 3, constraints=constraints)
    rates = np.array([1.0, -2.0, 1.0])
    samples = stop(made, [0.0, 0.0, 0.0], rates)
    assert samples[-1, POSITION] == pytest.approx(rates * np.abs(rates) / (2 * np.array([0.5, 4.0, 4.0])))


def test_a_planned_stop_is_continuous_keeps_all_limits_and_ends_at_rest():
    """From random states that a jerk-limited motion inside the position limits can have, at 1 kHz."""
    rng = np.random.default_rng(7)
    for _ in range(100):
        a_max, j_max = 10.0 ** rng.uniform(0, 1.3, 3), 10.0 ** rng.uniform(1.3, 2.3, 3)
        limits = [
            JointLimits(lower=-9.0, upper=9.0, velocity=2.0, acceleration=float(a), jerk=float(j))
            for a, j in zip(a_max, j_max, strict=True)
        ]
        q, a = rng.uniform(-1, 1, 3), rng.uniform(-0.9, 0.9, 3) * a_max
        room = 2.0 - a**2 / (2.0 * j_max)  # the velocity that remains when the acceleration is brought to 0
        a = np.where(room > 0.0, a, 0.0)
        v = rng.uniform(-0.99, 0.99, 3) * np.where(room > 0.0, room, 2.0)
        samples = stop(stopping(limits, planner=stopped), q, v, a)
        position, velocity, acceleration, _ = samples.transpose(1, 0, 2)
        assert velocity[0] == pytest.approx(v) and acceleration[0] == pytest.approx(a)
        assert not velocity[-1].any() and not acceleration[-1].any()
        assert (np.abs(velocity) <= 2.0 * (1 + 1e-9)).all()
        assert (np.abs(acceleration) <= a_max * (1 + 1e-9)).all()
        assert (np.abs(np.diff(velocity, axis=0)) <= a_max * PERIOD * (1 + 1e-6)).all()
        assert (np.abs(np.diff(acceleration, axis=0)) <= j_max * PERIOD * (1 + 1e-6)).all()
        # The trapezoid rule is off by at most j dt^3 / 12 per tick.
        steps = 0.5 * (velocity[1:] + velocity[:-1]) * PERIOD
        assert (np.abs(np.diff(position, axis=0) - steps) <= j_max * PERIOD**3 / 10).all()


def test_one_joint_stops_in_the_time_of_the_closed_form():
    """From a0 to -A, along it, and to 0: T = (a0 + 2 A) / j + (v0 + a0^2 / (2 j) - A^2 / j) / A; without a plateau
    A^2 = j v0 + a0^2 / 2."""
    rng = np.random.default_rng(8)
    plateaus = 0
    for _ in range(60):
        most, j = float(10.0 ** rng.uniform(0, 1)), float(10.0 ** rng.uniform(1, 2))
        v, a = rng.uniform(0.2, 2.0), rng.uniform(0.0, 1.0) * most
        peak = np.sqrt(j * v + a**2 / 2.0)
        plateaus += peak > most
        A = min(peak, most)
        T = (a + 2.0 * A) / j + (v + a**2 / (2.0 * j) - A**2 / j) / A
        made = stopping([JointLimits(acceleration=most, jerk=j)], planner=stopped)
        samples = stop(made, [0.0], [v], [a])
        moving = np.flatnonzero(samples[:, VELOCITY, 0])
        assert moving[-1] * PERIOD == pytest.approx(T, abs=1.5 * PERIOD)
    assert 10 < plateaus < 50


def test_joints_on_a_straight_path_stay_on_it():
    """Velocity and acceleration along one direction: all joints stop together, on that line."""
    direction = np.array([1.0, -0.5, 0.2])
    made = stopping([JointLimits(acceleration=a, jerk=50.0) for a in (5.0, 2.0, 9.0)], planner=stopped)
    samples = stop(made, [0.0, 0.0, 0.0], direction, 0.4 * direction)
    along = samples[:, POSITION, :1] * direction
    assert samples[:, POSITION] == pytest.approx(along, abs=1e-9)


def test_a_joint_that_cannot_stop_inside_by_the_plan_does_not_change_the_others():
    """It has a lower deceleration than it moved with: its limit comes first. The others keep theirs."""
    limits = [JointLimits(lower=-1.0, upper=1.0, acceleration=2.0, jerk=20.0)] * 2
    made = stopping(limits, planner=stopped)
    samples = stop(made, [0.9, 0.0], [1.0, 1.0])
    assert samples[:, POSITION, 0].max() <= 1.0 + 1e-6
    assert np.abs(np.diff(samples[:, VELOCITY, 1])).max() <= 2.0 * PERIOD * (1 + 1e-6)
    alone = stop(stopping(limits[:1], planner=stopped), [0.0], [1.0])
    assert samples[-1, POSITION, 1] == pytest.approx(alone[-1, POSITION, 0])


@pytest.mark.parametrize("compat", ["ros1", "ros2"])
def test_with_compat_stops_are_those_of_ros(compat):
    """Constant deceleration: half way, the velocity is half; planned, the jerk limit makes it later."""
    ends = []
    for chosen in (compat, None):
        arm = JointTrajectoryController(
            name="arm", joints=["a"], command_interfaces=["position"], compat=chosen, stop_planner=stopped,
            limits=[JointLimits(acceleration=2.0, jerk=20.0)],
        )  # fmt: skip
        measured = JointState(np.zeros(1), np.zeros(1), np.zeros(1))
        arm.update(0.0, PERIOD, measured)
        goal = arm.send_goal(
            JointTrajectory.of_arrays(("a",), [0.0, 4.0, 9.0], [[0.0], [4.0], [9.0]], [[1.0], [1.0], [0.0]])
        )
        references = []
        for tick in range(1, 1500):
            if tick == 2:
                goal.cancel()
            arm.update(tick * PERIOD, PERIOD, measured)
            references.append(arm.output.velocity[0])
        ends.append(np.flatnonzero(references)[-1] * PERIOD)
    assert ends == pytest.approx([0.5, 0.5 + 2.0 / 20.0], abs=0.1 * 2.0 / 20.0)


def test_an_aborted_goal_stops_from_the_measured_motion_within_the_limits():
    """The reference goes to the measured position and has its velocity there; at rest it holds it at once."""
    limit = JointLimits(acceleration=2.0, jerk=20.0)
    for speed in (0.0, 0.5):
        arm = JointTrajectoryController(
            name="arm", joints=["a"], command_interfaces=["position"], limits=[limit], stop_planner=stopped,
            constraints=ConstraintsSpec(joints={"a": JointConstraintSpec(trajectory=0.1)}),
        )  # fmt: skip
        still = JointState(np.zeros(1), np.zeros(1), np.zeros(1))
        arm.update(0.0, PERIOD, still)
        goal = arm.send_goal(
            JointTrajectory.of_arrays(("a",), [0.0, 4.0, 9.0], [[0.0], [4.0], [9.0]], [[1.0], [1.0], [0.0]])
        )
        tick = 0
        while goal.active:
            tick += 1
            arm.update(tick * PERIOD, PERIOD, JointState(np.zeros(1), np.array([speed]), np.zeros(1)))
        assert goal.result.status == "aborted"
        assert (arm.output.position[0], arm.output.velocity[0]) == (0.0, speed)
        before = speed
        for later in range(tick + 1, tick + 500):
            arm.update(later * PERIOD, PERIOD, still)
            assert abs(arm.output.velocity[0] - before) <= 2.0 * PERIOD * (1 + 1e-6)
            before = arm.output.velocity[0]
        # v^2 / (2 a) + v a / (2 j): a stop with ramps of the deceleration.
        assert arm.output.position[0] == pytest.approx(speed**2 / 4.0 + speed * 2.0 / 40.0 if speed else 0.0, rel=0.01)
