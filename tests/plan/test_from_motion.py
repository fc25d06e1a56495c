"""Motions from any state of motion: against a stop in closed form, and limits by difference quotients."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.plan.from_motion import stopped
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.trajectory import JointTrajectory

PERIOD = 1e-3
LIMITS = MotionLimits(
    ("a", "b"), np.full(2, -9.0), np.full(2, 9.0), np.array([2.0, 3.0]), np.array([5.0, 8.0]), np.array([50.0, 100.0])
)


def stop(limits: MotionLimits, state: tuple[Array, Array, Array], *, together: bool = False) -> JointTrajectory:
    return stopped(
        limits.names, state, acceleration=limits.acceleration, jerk=limits.jerk, period=PERIOD, together=together
    )


def kept(motion: JointTrajectory, limits: MotionLimits) -> None:
    v, a = motion.velocities, motion.accelerations
    assert v is not None and a is not None
    np.testing.assert_allclose(np.diff(motion.positions, axis=0) / PERIOD, 0.5 * (v[1:] + v[:-1]), atol=1e-3)
    assert np.all(np.abs(v) <= limits.velocity * 1.0001)
    assert np.all(np.abs(np.diff(v, axis=0)) / PERIOD <= limits.acceleration * 1.0001)
    assert np.all(np.abs(np.diff(a, axis=0)) / PERIOD <= limits.jerk * 1.001)


def test_a_stop_from_constant_speed_takes_v_over_a_and_a_over_j() -> None:
    """With v a > a^2 / j the acceleration ramps up and down: T = v / a + a / j, d = v T / 2."""
    v = np.array([1.5, -2.5])
    motion = stop(LIMITS, (np.zeros(2), v, np.zeros(2)))
    T = np.abs(v) / LIMITS.acceleration + LIMITS.acceleration / LIMITS.jerk
    assert motion.duration == pytest.approx(T.max(), abs=PERIOD)
    np.testing.assert_allclose(motion.positions[-1], v * T / 2.0, atol=1e-6)
    kept(motion, LIMITS)


def test_without_a_jerk_limit_a_stop_is_one_deceleration() -> None:
    limits = replace(LIMITS, jerk=np.full(2, np.inf))
    v = np.array([1.5, -2.5])
    motion = stop(limits, (np.zeros(2), v, np.zeros(2)))
    np.testing.assert_allclose(motion.positions[-1], v * np.abs(v) / (2.0 * limits.acceleration), atol=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_any_state_leads_to_rest_within_the_limits(seed: int) -> None:
    rng = np.random.default_rng(seed)

    def state() -> tuple[Array, Array, Array]:
        # Within what the jerk can still bring back before the velocity limit.
        return rng.uniform(-1.0, 1.0, 2), rng.uniform(-0.7, 0.7, 2) * LIMITS.velocity, rng.uniform(-0.7, 0.7, 2) * 4.0

    q, v, a = state()
    for together in (False, True):
        motion = stop(LIMITS, (q, v, a), together=together)
        kept(motion, LIMITS)
        assert motion.velocities is not None
        np.testing.assert_allclose(motion.positions[0], q)
        np.testing.assert_allclose(motion.velocities[0], v)
        np.testing.assert_array_equal(motion.velocities[-1], 0.0)
