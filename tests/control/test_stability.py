"""Poles of sampled loops against the loops themselves, tick by tick, and against the closed forms."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.control.stability import (
    Loop,
    gain_margin,
    is_stable,
    largest_damping,
    largest_integral,
    largest_stiffness,
    largest_velocity_gain,
    poles,
    unstable_share,
    velocity_loop_poles,
)

H = 1e-3


def remains(loop: Loop, *, ticks: int = 3000) -> float:
    """How much of a push is left after so many ticks: the recurrence as an engine and a PID go through it."""
    inertia, b = float(loop.mass[0, 0]), float(loop.damping[0])
    q, v, z = 1.0, 0.0, 0.0
    waiting = [0.0] * (int(loop.delay[0]) if loop.delay is not None else 0)
    step = loop.period / (loop.substeps or 400)
    late = step * b if step * b > 0.5 * inertia else 0.0
    for _ in range(ticks):
        waiting.append(-float(loop.p[0]) * q - float(loop.d[0]) * v - float(loop.i[0]) * z)
        z += loop.period * q
        u = waiting.pop(0)
        for _ in range(loop.substeps or 400):
            v += step * (u - b * v) / (inertia + late)
            q += step * v
        if abs(q) > 1e6:
            return math.inf
    return max(abs(q), abs(v) * loop.period)


@pytest.mark.parametrize("substeps", [1, 3])
@pytest.mark.parametrize("delay", [0, 1, 2])
@pytest.mark.parametrize("damping", [0.0, 0.3, 3.0])
def test_the_largest_damping_is_where_the_loop_itself_stops_to_settle(
    substeps: int, delay: int, damping: float
) -> None:
    def loop(d: float) -> Loop:
        return Loop.of_joint(
            0.002, p=40.0, d=d, i=100.0, damping=damping, period=H, substeps=substeps, delay=delay
        )  # fmt: skip

    bound = largest_damping(loop(0.1))
    assert is_stable(loop(0.98 * bound))
    assert remains(loop(0.98 * bound)) < 1e-3
    assert not is_stable(loop(1.02 * bound))
    assert remains(loop(1.02 * bound)) > 1.0


def test_held_exactly_the_bounds_are_those_of_the_double_integrator() -> None:
    """kp h / 2 < kd < 2 I / h."""
    inertia, p = 0.004, 800.0
    loop = Loop.of_joint(inertia, p=p, d=1.0, period=H, substeps=None)
    assert largest_damping(loop) == pytest.approx(2 * inertia / H, rel=2e-3)
    assert largest_stiffness(loop) == pytest.approx(2 * 1.0 / H, rel=2e-3)
    assert remains(Loop.of_joint(inertia, p=p, d=0.9 * p * H / 2, period=H, substeps=None), ticks=300) > 1.0


@given(
    st.floats(1e-4, 10.0), st.floats(0.1, 30.0), st.floats(0.1, 3.0), st.floats(1e-4, 1e-2)
)  # fmt: skip
@settings(max_examples=15, deadline=None)
def test_in_one_step_of_euler_the_bound_is_two_inertias_less_half_the_stiffness(
    inertia: float, hertz: float, ratio: float, period: float
) -> None:
    """kd < 2 I / h - kp h / 2."""
    w = math.tau * hertz
    p, d = inertia * w * w, 2 * ratio * inertia * w
    bound = 2 * inertia / period - p * period / 2
    loop = Loop.of_joint(inertia, p=p, d=d, period=period)
    assert is_stable(loop) == (d < bound)
    if bound > 0.0:
        assert largest_damping(loop) == pytest.approx(bound, rel=5e-3)


def test_many_small_steps_come_to_the_exact_ones() -> None:
    one = Loop.of_joint(0.01, p=50.0, d=1.0, i=30.0, damping=0.2, period=5e-3, substeps=None, delay=1)
    many = Loop.of_joint(0.01, p=50.0, d=1.0, i=30.0, damping=0.2, period=5e-3, substeps=4000, delay=1)
    np.testing.assert_allclose(poles(many), poles(one), atol=1e-4)


def test_slow_poles_are_those_of_the_continuous_loop() -> None:
    """ln z / h = -zeta w -+ i w sqrt(1 - zeta^2)."""
    w, ratio = 30.0, 0.5
    found = np.log(poles(Loop.of_joint(2.0, p=2.0 * w * w, d=2 * ratio * 2.0 * w, period=1e-4, substeps=None))) / 1e-4
    np.testing.assert_allclose(np.sort(found.imag), [-w * math.sqrt(0.75), w * math.sqrt(0.75)], rtol=2e-3)
    np.testing.assert_allclose(found.real, -ratio * w, rtol=2e-3)


def test_two_loops_that_are_stable_alone_may_not_be_together() -> None:
    """Two joints that share a light link: the inertia that both push at once is less than each meets alone."""
    mass = np.array([[1.0, 0.9], [0.9, 1.0]]) * 0.01
    d = np.array([3.0, 3.0])
    own = 1.0 / np.diag(np.linalg.inv(mass))
    for k in range(2):
        assert is_stable(Loop.of_joint(float(own[k]), p=1.0, d=float(d[k]), period=H))
    whole = Loop(mass, np.ones(2), d, np.zeros(2), np.zeros(2), H)
    assert not is_stable(whole)
    # The softest way to push: (1, -1) / sqrt 2, of the inertia 0.01 (1 - 0.9).
    assert largest_eigenvalue(mass, d) * H > 2.0
    margin = gain_margin(Loop(mass, np.ones(2), d / 4, np.zeros(2), np.zeros(2), H))
    assert margin == pytest.approx(2.0 / (largest_eigenvalue(mass, d / 4) * H), rel=0.01)


def test_the_largest_integral_is_where_the_loop_itself_stops_to_settle() -> None:
    """With as much inertia and damping that time does not count as discrete, it is that of Routh: i < p d / I."""

    def loop(i: float) -> Loop:
        return Loop.of_joint(0.083, p=80.0, d=6.0, i=i, period=H)

    bound = largest_integral(loop(1.0))
    assert bound == pytest.approx(80.0 * 6.0 / 0.083, rel=0.03)
    assert remains(loop(0.95 * bound), ticks=20000) < 1e-2
    assert remains(loop(1.05 * bound), ticks=20000) > 1.0
    assert largest_integral(Loop.of_joint(0.083, p=80.0, d=0.0, period=H)) == 0.0


def routh(inertia: float, p: float, d: float, i: float) -> bool:
    """Exactly, in one step of Euler: w^3 + (a + b) w^2 + (a + c) w + c with w = z - 1, a = p h^2 / I, b = d h / I and
    c = i h^3 / I; with w = 2 s / (1 - s) the circle is the left half plane, and Routh's criterion decides."""
    h, mass = Fraction(H), Fraction(inertia)
    a, b, c = (Fraction(gain) * h**k / mass for gain, k in ((p, 2), (d, 1), (i, 3)))
    third, second, first = 8 - 2 * a - 4 * b + c, 4 * b - c, 2 * a - c
    return min(third, second, first) > 0 and second * first > c * third


@pytest.mark.parametrize("i", [1e-14, 1e-10, 1e-6, 1e-4, 0.01, 0.1, 1.0, 100.0])
@pytest.mark.parametrize(
    ("inertia", "p", "d"),
    [(4.0, 12000.0, 200.0), (0.2, 800.0, 50.0), (0.05, 12000.0, 30.0), (4.0, 12000.0, 0.0), (0.2, 800.0, 399.7)],
)
def test_a_slow_integral_makes_no_loop_unstable_that_is_not(inertia: float, p: float, d: float, i: float) -> None:
    loop = Loop.of_joint(inertia, p=p, d=d, i=i, period=H)
    assert is_stable(loop) == routh(inertia, p, d, i)
    assert (gain_margin(loop) > 1.0) == routh(inertia, p, d, i)


def test_neither_do_slow_integrals_of_joints_that_are_coupled() -> None:
    mass = np.array([[4.0, 1.0], [1.0, 2.0]])
    p, d, slow = np.array([12000.0, 800.0]), np.array([200.0, 50.0]), np.array([0.01, 1e-5])
    still = np.zeros(2)
    assert is_stable(Loop(mass, p, d, slow, still, H))
    # What is left without the two slow poles are the poles of the loop without integrals.
    both, without = poles(Loop(mass, p, d, slow, still, H)), poles(Loop(mass, p, d, still, still, H))
    np.testing.assert_allclose(both[:2], 1.0 - H * slow[::-1] / p[::-1], atol=1e-12)
    np.testing.assert_allclose(np.sort_complex(both[2:]), np.sort_complex(without), atol=1e-8)
    assert not is_stable(Loop(mass, p, 100.0 * d, slow, still, H))


def largest_eigenvalue(mass: np.ndarray, d: np.ndarray) -> float:
    return float(np.max(np.linalg.eigvals(np.linalg.solve(mass, np.diag(d))).real))


def test_an_integral_of_one_joint_leaves_the_others_alone() -> None:
    gains = {"p": np.array([50.0, 40.0]), "d": np.array([1.0, 1.0]), "damping": np.zeros(2), "period": H}
    both = Loop(mass=np.diag([0.01, 0.02]), i=np.array([0.0, 30.0]), **gains)
    assert is_stable(both)
    alone = [Loop.of_joint(0.01, p=50.0, d=1.0, period=H), Loop.of_joint(0.02, p=40.0, d=1.0, i=30.0, period=H)]
    expected = np.sort_complex(np.concatenate([poles(each) for each in alone]))
    np.testing.assert_allclose(np.sort_complex(poles(both)), expected, atol=1e-9)


def test_a_mode_that_diverges_is_that_of_the_joint_with_too_much_damping() -> None:
    mass = np.array([[0.02, 0.001], [0.001, 0.01]])
    loop = Loop(mass, np.array([1.0, 1.0]), np.array([1.0, 30.0]), np.zeros(2), np.zeros(2), H)
    pole, share = unstable_share(loop)
    assert abs(pole) > 1.0
    assert share[1] > 0.9
    assert share.sum() == pytest.approx(1.0)


def test_a_loop_without_stiffness_is_stable_where_its_velocity_is() -> None:
    for d, stable in ((3.9, True), (4.1, False)):
        loop = Loop.of_joint(0.002, p=0.0, d=d, period=H)
        assert is_stable(loop) is stable
    assert gain_margin(Loop.of_joint(0.002, p=0.0, d=1.0, period=H)) == pytest.approx(4.0, rel=2e-3)
    assert not is_stable(Loop.of_joint(0.002, p=1.0, d=0.0, period=H))  # swings for ever


@pytest.mark.parametrize(("i", "d"), [(0.0, 0.0), (0.0, 0.3), (500.0, 0.0), (500.0, 0.3)])
def test_the_largest_gain_on_a_velocity_is_where_the_loop_itself_stops_to_settle(i: float, d: float) -> None:
    def left(p: float) -> float:
        q, z, v = 1.0, 0.0, 0.0
        for _ in range(3000):
            v = -p * q - i * z - d * v
            z += H * q
            q += H * v
        return abs(q)

    most = largest_velocity_gain(i=i, d=d, period=H)
    for share, stable in ((0.98, True), (1.02, False)):
        assert bool(abs(velocity_loop_poles(p=share * most, i=i, d=d, period=H)[0]) < 1.0) is stable
        assert (left(share * most) < 1e-3) is stable
    assert abs(velocity_loop_poles(p=most, i=i, d=d, period=H)[0]) == pytest.approx(1.0)
