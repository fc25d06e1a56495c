"""Laws of a changing speed: the joints stay on the path of the trajectory, and keep its limits."""

import numpy as np
import pytest

from manipcli.control.controller import JointState
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.trajectory_clock import TrajectoryClock
from manipcli.description.elements import JointLimits
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint

PERIOD = 1e-3
NAMES = ("a", "b")
MIDDLE, END = ([0.7, -0.2], 0.6), ([1.5, 0.9], 1.4)


def points():
    """From rest over a point in motion to rest."""
    return [
        TrajectoryPoint(MIDDLE[0], MIDDLE[1], [1.5, 0.8], [0.0, 3.0]),
        TrajectoryPoint(END[0], END[1], [0.0, 0.0], [0.0, 0.0]),
    ]


def whole():
    """With its start."""
    return JointTrajectory(NAMES, points(), TrajectoryPoint([0.0, 0.0], 0.0, [0.0, 0.0], [0.0, 0.0]))


def densely(count):
    times = np.linspace(0.0, END[1], count)
    return times, *whole().sample(times)


def most():
    """Limits at the largest velocities and accelerations of the trajectory."""
    _, _, velocity, acceleration = densely(5001)
    return [
        JointLimits(velocity=float(v), acceleration=float(a))
        for v, a in zip(abs(velocity).max(axis=0) * 1.001, abs(acceleration).max(axis=0), strict=True)
    ]


class Ride:
    """A joint that is where its reference is, and what the controller does with the trajectory."""

    def __init__(self, limits=None, **more):
        self.controller = JointTrajectoryController(
            name="arm", joints=NAMES, command_interfaces=("position", "velocity"), limits=limits, **more
        )
        self.tick, self.rows, self.factors = 0, [], []
        self.position, self.velocity = np.zeros((2, 2))
        self.run(1)
        self.handle = self.controller.send_goal(JointTrajectory(NAMES, points()))

    def run(self, ticks):
        for _ in range(ticks):
            measured = JointState(self.position, self.velocity, np.zeros(2))
            output = self.controller.update(self.tick * PERIOD, PERIOD, measured)
            self.tick += 1
            self.rows.append(output.rows.copy())
            self.factors.append(self.controller.scaling.actual)
            self.position, self.velocity = output.position.copy(), output.velocity.copy()
        return self

    def end(self, most=20_000):
        while self.handle.active and most:
            most -= 1
            self.run(1)
        return self

    @property
    def positions(self):
        return np.array(self.rows)[:, 0]


def far_from_path(positions):
    """Largest distance of positions (T, 2) from the path, by brute force over a dense polyline."""
    _, path, _, _ = densely(2001)
    first, step = path[:-1], np.diff(path, axis=0)
    worst = 0.0
    for q in positions:
        share = np.clip(((q - first) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-30), 0.0, 1.0)
        worst = max(worst, float(np.linalg.norm(first + share[:, None] * step - q, axis=1).min()))
    return worst


def changed(ride, seed):
    """Random changes of the factor, pauses and resumptions."""
    random = np.random.default_rng(seed)
    scaling = ride.controller.scaling
    for _ in range(12):
        ride.run(int(random.integers(1, 300)))
        if not ride.handle.active:
            break
        [lambda: scaling.set(float(random.uniform(0.0, 1.0))), scaling.pause, scaling.resume][random.integers(3)]()
    scaling.resume()
    scaling.set(1.0)
    return ride.end()


@pytest.mark.parametrize("seed", range(2))
def test_a_scaled_trajectory_is_on_the_same_path_within_the_same_limits(seed):
    limits = most()
    ride = changed(Ride(limits), seed)
    assert ride.handle.status == "succeeded"
    assert min(ride.factors) < 0.9, "the ride was scaled"
    assert far_from_path(ride.positions[::23]) < 1e-6
    np.testing.assert_allclose(ride.positions[-1], END[0], atol=1e-9)
    rows = np.array(ride.rows)
    velocity = np.diff(rows[:, 0], axis=0) / PERIOD
    acceleration = np.diff(velocity, axis=0) / PERIOD
    for j, limit in enumerate(limits):
        assert abs(velocity[:, j]).max() <= limit.velocity * 1.001
        assert abs(acceleration[:, j]).max() <= limit.acceleration * 1.03  # differences lag by a tick
        assert abs(rows[:, 2, j]).max() <= limit.acceleration * (1 + 1e-9)  # the reference itself
    np.testing.assert_allclose(rows[:-1, 3], rows[1:, 0], atol=1e-12)  # a command is the next reference
    np.testing.assert_allclose(rows[1:-1, 1], (velocity[1:] + velocity[:-1]) / 2, atol=1e-2)


def test_speed_one_changes_no_bit():
    plain, same = Ride(most()), Ride(most())
    plain.end()
    for _ in range(10):
        same.run(100).controller.scaling.set(1.0)
        same.controller.scaling.resume()
    same.end()
    assert np.array(plain.rows).tobytes() == np.array(same.rows).tobytes()


def test_a_pause_rests_on_the_path_and_a_resumed_goal_has_all_its_time():
    """The integral of the speed over time is the duration of the trajectory."""
    ride = Ride()
    ride.run(500).controller.scaling.pause()
    ride.run(1500)
    assert ride.factors[-1] == 0.0
    assert not np.array(ride.rows[-1])[1:3].any()
    assert ride.handle.active
    assert far_from_path(ride.positions[::50]) < 1e-6
    assert (ride.positions[-1000:] == ride.positions[-1]).all()
    assert ride.factors[500:].index(0.0) * PERIOD == pytest.approx(
        1.0 / 4.0 + 4.0 / 40.0, abs=3 * PERIOD
    )  # trapezoid of rates
    ride.controller.scaling.resume()
    ride.end()
    assert ride.handle.status == "succeeded"
    assert np.trapezoid(ride.factors[1:], dx=PERIOD) == pytest.approx(END[1], abs=2 * PERIOD)


def test_a_new_goal_of_a_slow_trajectory_goes_on_with_its_motion():
    """Also while the speed changes: no step of velocity that the acceleration limit forbids."""
    ride = Ride(most())
    ride.run(600).controller.scaling.set(0.3)
    ride.run(60)
    assert 0.3 < ride.factors[-1] < 1.0
    ride.controller.send_goal(JointTrajectory(NAMES, [TrajectoryPoint([1.2, 0.5], 1.0, [0.0, 0.0], [0.0, 0.0])]))
    ride.run(400)
    jump = np.diff(np.array(ride.rows)[655:670, 1], axis=0)
    assert abs(jump).max() / PERIOD < 1.2 * max(limit.acceleration for limit in most())
    assert ride.factors[-1] == 0.3


def test_a_change_waits_while_the_trajectory_itself_brakes_at_the_limit():
    """From 1 rad/s at constant deceleration to rest: no pause stops it earlier."""
    points = [TrajectoryPoint([0.5, 0.0], 0.5, [1.0, 0.0]), TrajectoryPoint([0.75, 0.0], 1.0, [0.0, 0.0])]
    ride = Ride([JointLimits(acceleration=2.0)] * 2)
    ride.handle = ride.controller.send_goal(JointTrajectory(NAMES, points))
    ride.run(600).controller.scaling.pause()
    ride.end()
    assert ride.handle.result.time == pytest.approx(1.0, abs=2 * PERIOD)


@pytest.mark.parametrize("seed", range(3))
def test_the_speed_changes_without_a_step_of_its_rate_and_arrives(seed):
    """A clock without limits: |df/dt| <= 4/s, |d2f/dt2| <= 40/s2, between the speeds that were wanted."""
    random = np.random.default_rng(seed)
    clock = TrajectoryClock(0.0)
    path = np.zeros((4, 1))
    speeds, tick = [], 0
    for _ in range(15):
        wanted = float(random.choice([0.0, 1.0, random.uniform()]))
        clock.change(wanted, tick * PERIOD, PERIOD, lambda s: path, np.array([np.inf]))
        for _ in range(int(random.choice([3, 40, 150, 500]))):
            speeds.append(clock.now(tick * PERIOD)[1])
            tick += 1
    clock.change(1.0, tick * PERIOD, PERIOD, lambda s: path, np.array([np.inf]))
    assert clock.now((tick + 500) * PERIOD)[1:] == (1.0, 0.0)
    rates = np.diff(speeds) / PERIOD
    assert abs(rates).max() <= 4.0 * (1 + 1e-9)
    assert abs(np.diff(rates)).max() <= 2.0 * 40.0 * PERIOD * (1 + 1e-9)  # two at once where a change meets another
    assert min(speeds) >= 0.0
    assert max(speeds) <= 1.0 + 1e-6
    s = [clock.now(k * PERIOD)[0] for k in range(tick, tick + 400)]
    assert (np.diff(s) >= 0.0).all()


def test_a_goal_in_a_pause_that_begins_in_motion_stops_on_its_own_path():
    """Without a step of its velocity: the motion is that of a stop which the pause came after."""
    limits = most()
    ride = Ride(limits)
    ride.run(600).handle.cancel()
    ride.run(20).controller.scaling.pause()
    moving = ride.rows[-1][1].copy()
    assert abs(moving).max() > 0.3
    ride.controller.send_goal(JointTrajectory(NAMES, [TrajectoryPoint([1.4, 0.8], 2.0, [0.0, 0.0])]))
    ride.run(800)
    velocity = np.array(ride.rows)[600:, 1]
    assert abs(np.diff(velocity, axis=0)).max() / PERIOD < 3.0 * max(limit.acceleration for limit in limits)
    assert ride.factors[-1] == 0.0
    assert not velocity[-1].any()
