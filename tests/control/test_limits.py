"""Joint limits on commands: numbers by hand, and the limiter against the pure functions."""

import math

import numpy as np
import pytest

from manipcli.control.limits import JointLimiter, limit_effort, limit_position, limit_velocity
from manipcli.model.robot import JointLimits


def test_position_is_clamped_to_its_limits_and_to_its_speed():
    pi = {"lower": -math.pi, "upper": math.pi, "dt": 1.0}
    for command, expected in ((4.0, math.pi), (-5.0, -math.pi), (0.0, 0.0)):
        assert limit_position(command, previous=0.0, **pi) == expected
    assert limit_position(2.0, previous=0.0, velocity=1.0, **pi) == 1.0
    assert limit_position(-3.0, previous=1.0, velocity=1.0, **pi) == 0.0
    assert limit_position(-math.pi, previous=2.0, velocity=1.0, **pi) == 1.0  # no command before: the measured 2.0


def test_velocity_is_clamped_and_cannot_run_past_a_position_limit():
    assert limit_velocity([5.0, -5.0, 0.5], velocity=2.0, dt=0.1).tolist() == [2.0, -2.0, 0.5]
    reach = {"velocity": 2.0, "lower": -1.0, "upper": 1.0, "dt": 0.1}
    assert limit_velocity(2.0, position=0.95, **reach) == pytest.approx(0.5)
    assert limit_velocity(-2.0, position=-0.95, **reach) == pytest.approx(-0.5)
    assert limit_velocity(1.0, position=1.2, **reach) == 0.0
    assert limit_velocity(-1.0, position=1.2, **reach) == -1.0
    assert limit_velocity(2.0, velocity=9.0, acceleration=3.0, previous=1.0, dt=0.1) == pytest.approx(1.3)


def test_effort_is_clamped_and_never_pushes_further_out():
    base = {"effort": 10.0, "lower": -1.0, "upper": 1.0, "max_velocity": 2.0}
    assert limit_effort(400.0, position=0.0, velocity=0.0, **base) == 10.0
    for q, v, command, expected in [
        (1.0, 0.1, 5.0, 0.0),
        (1.0, 0.1, -5.0, -5.0),
        (1.0, -0.1, 5.0, 5.0),  # on its way back: the limit has nothing to prevent
        (-1.0, 0.0, -5.0, 0.0),
        (0.0, 2.1, 5.0, 0.0),
        (0.0, 2.1, -5.0, -5.0),
        (0.0, -2.1, -5.0, 0.0),
    ]:
        assert limit_effort(command, position=q, velocity=v, **base) == expected


def test_the_limiter_applies_the_pure_functions_and_counts_cuts():
    rng = np.random.default_rng(0)
    limits = [JointLimits(-1, 1, 2, 10), JointLimits(-1, 1, 2, 10, 5), JointLimits(-1, 1, 2, 10), JointLimits()]
    limiter = JointLimiter(limits, ["effort", "velocity", "position", "effort"])
    counts = np.zeros(4, dtype=int)
    previous = None
    for _ in range(200):
        command, q, v = rng.normal(size=4) * [10, 3, 1, 1e6], rng.normal(size=4), 2 * rng.normal(size=4)
        expected = command.copy()
        expected[0] = limit_effort(
            command[0], effort=10, position=q[0], velocity=v[0], lower=-1, upper=1, max_velocity=2
        )
        expected[1] = limit_velocity(
            command[1],
            velocity=2,
            dt=0.01,
            position=q[1],
            lower=-1,
            upper=1,
            acceleration=5,
            previous=command[1] if previous is None else previous[1],
        )
        expected[2] = limit_position(
            command[2], lower=-1, upper=1, velocity=2, previous=q[2] if previous is None else previous[2], dt=0.01
        )
        before = command.copy()
        limited = limiter.apply(command, q, v, 0.01).copy()
        assert np.array_equal(command, before)
        assert limited == pytest.approx(expected)
        assert np.array_equal(limiter.saturated, limited != command)
        counts += limited != command
        previous = limited
    assert np.array_equal(limiter.saturations, counts)
    assert counts[3] == 0
    limiter.reset()
    assert not limiter.saturations.any()


def test_what_nobody_commands_passes_through():
    limiter = JointLimiter([JointLimits(-1, 1, 2, 10)], [None])
    assert limiter.apply(np.array([99.0]), np.array([5.0]), np.array([9.0]), 0.001).tolist() == [99.0]
