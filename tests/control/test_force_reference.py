"""The reference that presses: closed forms against a stiff wall, its bounds, and what the sensor is zeroed from."""

from __future__ import annotations

import math

import numpy as np
import pytest

from manipcli.control.force_reference import ZEROING, ForceReference, ForceReferenceSpec

PERIOD, STIFFNESS, TARGET = 1e-3, 400.0, 10.0
AWAY = 6.3
"""[N] Weight of the hand and offset of the sensor."""


def pressing(wall: float, *, seconds: float, noise: float = 0.0, **more: object) -> tuple[np.ndarray, np.ndarray]:
    """Shift and true force at every tick, of a spring without mass in front of a rigid wall."""
    spec = ForceReferenceSpec.model_validate({"sensor": "wrist", "axis": "y", "target": TARGET, **more})
    reference, rng = ForceReference(spec, STIFFNESS), np.random.default_rng(1)
    shifts, forces = [], []
    for _ in range(round(seconds / PERIOD)):
        force = STIFFNESS * max(0.0, reference.shift - wall)
        reference.reading = np.array([99.0, AWAY - force + noise * rng.standard_normal(), -99.0, 9.0, 9.0, 9.0])
        shifts.append(reference.update(PERIOD))
        forces.append(force)
    return np.array(shifts), np.array(forces)


def test_the_force_tends_to_the_target_with_the_time_constant_of_the_bandwidth() -> None:
    """From contact on, p = target (1 - exp(-2 pi b t)): a speed that bounds nothing, and a wall that is touched."""
    _, forces = pressing(0.0, seconds=1.1, bandwidth=2.0, speed=1.0)
    t = PERIOD * np.arange(len(forces)) - ZEROING
    expected = np.where(t > 0.0, TARGET * -np.expm1(-math.tau * 2.0 * np.maximum(t, 0.0)), 0.0)
    # A step of 1 ms is 1.3 % of the time constant of 80 ms: up to 2 steps late.
    np.testing.assert_allclose(forces, expected, atol=0.03 * TARGET)
    assert forces[-1] == pytest.approx(TARGET, abs=1e-3)
    assert forces.max() <= TARGET + 1e-9


def test_before_contact_the_reference_moves_at_its_speed_and_no_farther_than_its_reach() -> None:
    shifts, forces = pressing(1.0, seconds=3.0, speed=0.02, reach=0.05)
    assert not forces.any()
    steps = np.diff(shifts)
    still = round(ZEROING / PERIOD)
    assert not shifts[: still - 1].any()
    assert steps.max() == pytest.approx(0.02 * PERIOD)
    assert shifts[-1] == 0.05


def test_a_target_against_the_axis_pulls() -> None:
    shifts, _ = pressing(1.0, seconds=3.0, target=-TARGET, reach=0.03)
    assert shifts[-1] == -0.03


def test_noise_leaves_the_mean_at_the_target() -> None:
    """Noise of 0.5 N: the mean over a second is off by that of the zeroing, 0.5 / sqrt(100) N, and by little more."""
    _, forces = pressing(0.01, seconds=4.0, noise=0.5)
    assert forces[-1000:].mean() == pytest.approx(TARGET, abs=4 * 0.05)
    assert forces[-1000:].std() < 0.1  # bandwidth 1 Hz of 500 Hz passes sqrt(pi / 1000) of 0.5 N


def test_the_sensor_is_zeroed_at_every_activation() -> None:
    spec = ForceReferenceSpec(sensor="wrist", axis="x", target=TARGET)
    reference = ForceReference(spec, STIFFNESS)
    for offset in (0.0, 25.0):
        reference.reset()
        reference.reading = np.array([offset, *np.zeros(5)])
        for _ in range(150):
            reference.update(PERIOD)
        pressed = reference.shift
        reference.reading = np.array([offset - TARGET, *np.zeros(5)])
        assert reference.update(PERIOD) == pytest.approx(pressed, abs=1e-12) and pressed > 0.0
