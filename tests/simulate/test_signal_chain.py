"""Laws of the signal chain over 100,000 measurements, against what statistics and the theory of filters say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from manipcli.core.geometry import Array
from manipcli.simulate.sensor import Quantity
from manipcli.simulate.signal_chain import Sampling, SignalChain
from manipcli.spec.sensors import Noise

PERIOD = 1e-3
COUNT = 100_000


def measured(
    truth: Array, noise: Noise[float] | None = None, *, seed: int = 1, name: str = "wrist", limit: float = np.inf,
    **sampling: Any,
) -> tuple[Array, Array]:  # fmt: skip
    """(arrivals,) ticks at which measurements arrive, and (arrivals, width) the measurements of a truth (T, width)."""
    now = np.zeros(truth.shape[1])
    quantity = Quantity("force", len(now), noise or Noise[float](), -limit, limit)
    chain = SignalChain([quantity], Sampling(PERIOD, **sampling), seed=seed, name=name, truth=now)
    ticks, values = [], []
    for tick, row in enumerate(truth):
        now[:] = row
        if chain.step(tick):
            ticks.append(tick)
            values.append(chain.reading.copy())
    return np.array(ticks), np.array(values)


def test_without_noise_the_reading_is_the_truth_to_the_bit() -> None:
    truth = np.random.default_rng(0).normal(size=(1000, 3))
    ticks, values = measured(truth)
    assert ticks.tolist() == list(range(1000))
    np.testing.assert_array_equal(values, truth)


def test_white_noise_has_its_standard_deviation_and_no_memory() -> None:
    _, values = measured(np.full((COUNT, 1), 5.0), Noise[float](white=0.3))
    error = values[:, 0] - 5.0
    assert error.std() == pytest.approx(0.3, rel=4 / np.sqrt(2 * COUNT))
    assert abs(error.mean()) < 4 * 0.3 / np.sqrt(COUNT)
    for lag in (1, 2, 255, 256):  # also across the borders of what is drawn at once
        assert abs(np.corrcoef(error[lag:], error[:-lag])[0, 1]) < 4.5 / np.sqrt(COUNT)


def test_the_bias_is_drawn_once_for_each_number() -> None:
    _, values = measured(np.zeros((3, 20_000)), Noise[float](bias=0.2))
    assert (values == values[0]).all()
    assert values[0].std() == pytest.approx(0.2, rel=4 / np.sqrt(2 * 20_000))


@pytest.mark.parametrize("every", [1, 20])
def test_the_variance_of_the_random_walk_after_1_s_does_not_depend_on_the_rate(every: int) -> None:
    """A thousand walks of 1 s; the variance is chi squared, so its relative deviation is sqrt(2 / n)."""
    n = 2000
    _, values = measured(np.zeros((1001, n)), Noise[float](walk=0.5), every=every)
    change = values[-1] - values[0]
    assert change.var() == pytest.approx(0.25, rel=4 * np.sqrt(2 / n))
    half = values[len(values) // 2] - values[0]
    assert half.var() == pytest.approx(0.125, rel=4 * np.sqrt(2 / n))


def test_quantisation_rounds_to_multiples_with_uniform_error() -> None:
    truth = np.random.default_rng(0).uniform(-3.0, 3.0, size=(COUNT // 10, 10))
    _, values = measured(truth, Noise[float](quantisation=0.25))
    np.testing.assert_array_equal(values, np.rint(truth / 0.25) * 0.25)
    assert (values - truth).std() == pytest.approx(0.25 / np.sqrt(12), rel=0.01)


def test_limits_saturate_after_noise_and_quantisation() -> None:
    _, values = measured(np.full((1000, 2), 9.9), Noise[float](white=1.0, quantisation=0.3), limit=10.0)
    assert values.max() == 10.0
    assert (values == 10.0).mean() > 0.3
    assert measured(np.array([[-20.0]]), limit=10.0)[1] == -10.0


def test_the_low_pass_halves_the_power_at_its_cut_off() -> None:
    """Sines through the filter: |H| = 1 / sqrt(1 + (f / fc)^2), as its time constant is 1 / (2 pi fc)."""
    times = np.arange(4000) * PERIOD
    for frequency in (1.0, 5.0, 10.0, 20.0, 40.0):
        _, values = measured(np.sin(2 * np.pi * frequency * times)[:, None], cutoff=10.0)
        settled = values[1000:, 0]
        gain = np.sqrt(2.0) * settled.std()
        assert gain == pytest.approx(1.0 / np.hypot(1.0, frequency / 10.0), rel=0.04)
    step = measured(np.concatenate((np.zeros((1, 1)), np.ones((200, 1)))), cutoff=10.0)[1][:, 0]
    np.testing.assert_allclose(step, 1.0 - np.exp(-2 * np.pi * 10.0 * PERIOD * np.arange(201)), atol=1e-12)


def test_the_bandwidth_of_filtered_white_noise() -> None:
    """An input that is white over ticks leaves with the variance a / (2 - a), a = 1 - exp(-2 pi fc T)."""
    truth = np.random.default_rng(0).normal(size=(COUNT, 1))
    _, values = measured(truth, cutoff=30.0)
    a = -np.expm1(-2 * np.pi * 30.0 * PERIOD)
    assert values[1000:].var() == pytest.approx(a / (2 - a), rel=0.05)


@pytest.mark.parametrize(("every", "delay"), [(1, 0), (1, 7), (5, 0), (5, 3), (5, 5), (5, 12)])
def test_each_measurement_arrives_once_and_delayed_to_the_tick(every: int, delay: int) -> None:
    truth = np.arange(1000.0)[:, None]
    ticks, values = measured(truth, every=every, delay=delay)
    assert ticks.tolist() == list(range(delay, 1000, every))
    assert (ticks - values[:, 0] == delay).all()


def test_the_share_of_lost_measurements() -> None:
    ticks, values = measured(np.arange(float(COUNT))[:, None], dropout=0.1, delay=2)
    lost = 1.0 - len(ticks) / COUNT
    assert lost == pytest.approx(0.1, abs=4 * np.sqrt(0.1 * 0.9 / COUNT) + 2 / COUNT)
    assert (ticks - values[:, 0] == 2).all()
    assert measured(np.zeros((1000, 1)), dropout=1.0)[0].size == 0


def test_its_noise_depends_on_seed_and_name_alone() -> None:
    zero = np.zeros((2000, 2))
    every = Noise[float](white=1.0, bias=1.0, walk=1.0)
    _, values = measured(zero, every)
    for again in (measured(zero, every), measured(zero, every, delay=0, dropout=0.0)):
        np.testing.assert_array_equal(values, again[1])
    for seed, name in ((2, "wrist"), (1, "wrist2")):
        other = measured(zero, every, seed=seed, name=name)[1]
        assert abs(np.corrcoef(np.diff(values[:, 0]), np.diff(other[:, 0]))[0, 1]) < 4.5 / np.sqrt(2000)
    ticks, kept = measured(zero, every, dropout=0.3)  # losses are drawn apart
    np.testing.assert_array_equal(kept, values[ticks])


def test_before_the_first_arrival_it_reads_the_truth_of_the_first_tick() -> None:
    now = np.array([3.0])
    chain = SignalChain([Quantity("force", 1)], Sampling(PERIOD, delay=5), seed=0, name="a", truth=now)
    assert not chain.step(0)
    now[:] = 4.0
    assert (chain.step(1), chain.reading[0]) == (False, 3.0)


def test_a_reset_begins_the_noise_again_and_drops_what_is_on_its_way() -> None:
    now = np.zeros(1)
    noise = Noise[float](white=1.0, walk=1.0, bias=1.0)
    chain = SignalChain([Quantity("force", 1, noise)], Sampling(PERIOD, delay=3), seed=0, name="a", truth=now)
    runs = []
    for _ in range(2):
        chain.reset()
        runs.append([chain.reading[0] if chain.step(tick) else None for tick in range(400)])
    assert runs[0] == runs[1]
    assert runs[0][:3] == [None] * 3
