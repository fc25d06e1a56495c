"""A force through a moving spring, in closed form: against something that yields, and against nothing."""

import math

import numpy as np
import pytest

from manipcli.control.pressing import DEPTH, OVER, SHARE, PressingReference, Relaxing
from manipcli.plan.compliance import Pressing

PERIOD = 1e-3
SPRING = 400.0
Z = np.array([0.0, 0.0, 1.0])


def press(body, *, time, gap=0.004, target=10.0, speed=0.01, reach=0.02):
    """Quasi-static: a spring pushes on a body of stiffness `body` behind a gap; reference and force over time."""
    law = PressingReference(Pressing(Z, target, speed, reach), SPRING)
    series = SPRING * body / (SPRING + body)
    forces, shifts, force = [], [], 0.0
    for _ in range(round(time / PERIOD)):
        stretch = force / SPRING
        shift = law.update(PERIOD, force, stretch)
        force = max(0.0, series * (shift - gap))
        forces.append(force)
        shifts.append(shift)
    return law, np.array(forces), np.array(shifts)


@pytest.mark.parametrize("body", [600.0, 4e3, 1e6])
def test_the_force_rises_as_an_exponential_and_never_exceeds_its_target(body):
    """p' = 2 pi b kappa (F - p), with kappa = k_body / (k + k_body), in contact, until 90 % of F at most c (1.3 F - p).

    c = k_body 0.75 speed / F is what the speed of the tool allows.
    """
    law, forces, _ = press(body, time=4.0)
    rate, slow = math.tau * body / (SPRING + body), body * SHARE * 0.01 / 10.0
    (begin,) = np.flatnonzero(forces >= 0.5)[:1]
    times = PERIOD * np.arange(len(forces) - begin)
    first = float(forces[begin])
    cross = (10.0 * rate - 13.0 * slow) / (rate - slow)  # of the two rates
    knee = first if slow > rate else max(first, min(9.0, cross))
    until = math.log((13.0 - first) / (13.0 - knee)) / slow
    rising = 13.0 - (13.0 - first) * np.exp(-slow * times)
    expected = np.where(times < until, rising, 10.0 - (10.0 - knee) * np.exp(-rate * (times - until)))
    np.testing.assert_allclose(forces[begin:], expected, atol=0.08)  # Euler steps of 1 ms
    assert forces.max() <= 10.0
    assert law.peak <= 10.0


def test_what_gives_way_moves_at_the_approach_speed_at_most():
    """So a button meets its end stop with that speed, and the impact is that of the approach."""
    _, forces, shifts = press(600.0, time=4.0)
    tool = shifts - forces / SPRING
    assert np.diff(tool).max() <= 0.011 * PERIOD  # 10 mm/s; the first force that counts as contact is 5 %


def test_an_impact_at_an_end_stop_stays_within_the_tolerance():
    """A mass on the damped spring meets a stop behind a spring: p + m v / T <= 1.3 F, with the speed v = F T / m."""
    mass, target, body, stop = 6.0, 8.0, 1000.0, 0.006
    law = PressingReference(Pressing(Z, target, target * PERIOD / mass, 0.03, hold=1.0), SPRING)
    damping = 2.0 * math.sqrt(SPRING * mass)
    x = speed = felt = highest = 0.0
    for _ in range(25000):
        shift = law.update(PERIOD, felt, law.shift - x)
        depth = max(0.0, x - 0.002)
        force = body * min(depth, stop) + max(0.0, depth - stop) * 2e5
        speed += PERIOD * (SPRING * (shift - x) - damping * speed - force) / mass
        x += PERIOD * speed
        felt += (1.0 - math.exp(-math.tau * 25.0 * PERIOD)) * (force - felt)
        if depth > 0.0:
            highest = max(highest, force + mass * speed / PERIOD)
    assert depth > stop
    assert highest <= (1.0 + OVER) * target
    np.testing.assert_allclose(felt, target, rtol=0.02)


@pytest.mark.parametrize("body", [600.0, 1e6])
def test_at_rest_the_force_is_stiffness_times_depth(body):
    """Springs in series: the reference is F / k + F / k_body beyond the surface."""
    _, forces, shifts = press(body, time=6.0)
    np.testing.assert_allclose(shifts[-1] - 0.004, 10.0 / SPRING + 10.0 / body, atol=1e-5)
    np.testing.assert_allclose(forces[-1], 10.0, atol=1e-3)


def test_before_contact_it_advances_at_its_speed_and_misses_beyond_its_reach():
    law, _, shifts = press(1e6, time=1.0, gap=1.0)
    np.testing.assert_allclose(shifts[:500], 0.01 * PERIOD * np.arange(1, 501), rtol=1e-9)
    assert law.missed == ""
    law, _, shifts = press(1e6, time=3.0, gap=1.0)
    assert "met nothing within 20 mm" in law.missed
    assert shifts[-1] <= 0.02 + 0.01 * PERIOD


def test_a_body_that_gives_way_is_missed():
    """The depth is at most `DEPTH` F / k and the reach, whatever is felt."""
    law = PressingReference(Pressing(Z, 10.0, 0.01, 0.02), SPRING)
    for _ in range(20000):
        law.update(PERIOD, 2.0, 0.0)
    assert "gave way" in law.missed
    assert law.contact is not None
    assert law.shift - law.contact <= DEPTH * 10.0 / SPRING + 0.02 + 1e-4


def test_a_lost_contact_leaves_no_wound_up_spring():
    law, forces, _ = press(1e6, time=3.0)
    before = law.shift
    law.update(PERIOD, 0.0, forces[-1] / SPRING)
    np.testing.assert_allclose(law.shift, before - 10.0 / SPRING + 0.01 * PERIOD, atol=1e-6)


def test_what_was_held_is_told_by_its_mean():
    law, _, _ = press(1e6, time=3.0)
    assert law.held > 1.0
    assert law.text.startswith("felt 9.9")
    assert "0 % over" in law.text


def test_a_shift_is_given_up_without_a_step():
    """Minimum jerk: from the shift to 0 at rest, with its middle at half time."""
    law = Relaxing(np.array([0.0, 0.0, 0.02]), 0.3)
    path = np.array([law.update(PERIOD)[2] for _ in range(400)])
    np.testing.assert_allclose(path[149], 0.01, atol=1e-6)
    assert path[-1] == 0.0
    assert np.abs(np.diff(path)).max() <= 1.0001 * 1.875 * 0.02 / 0.3 * PERIOD
