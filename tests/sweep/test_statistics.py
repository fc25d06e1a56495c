"""Statistics of a sweep, against SciPy, closed forms and brute force."""

from __future__ import annotations

import math
from itertools import permutations

import numpy as np
import pytest
from scipy import stats

from manipcli.sweep.statistics import (
    Rate,
    binomial_tail,
    quantiles,
    rank_correlation,
    ranks,
    shift,
    sobol_indices,
    two_sided,
)

RNG = np.random.default_rng(5)


@pytest.mark.parametrize(("passed", "count"), [(0, 1), (1, 1), (0, 40), (40, 40), (194, 200), (3, 7), (50, 100)])
def test_the_interval_of_a_rate_is_that_of_wilson(passed: int, count: int) -> None:
    expected = stats.binomtest(passed, count).proportion_ci(method="wilson")
    assert Rate(passed, count).interval == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert Rate(passed, count).interval[0] <= passed / count <= Rate(passed, count).interval[1]


def test_rank_correlation_with_ties_is_spearmans() -> None:
    x = RNG.integers(0, 6, 60).astype(float)
    y = x + RNG.normal(0.0, 2.0, 60)
    y[:5] = -math.inf  # failed without a margin: below all others, and equal
    found = rank_correlation(x, y)
    assert found is not None
    assert found.rho == pytest.approx(stats.spearmanr(x, y).statistic, abs=1e-12)
    assert ranks(x) == pytest.approx(stats.rankdata(x))
    assert rank_correlation(np.ones(60), y) is None


def test_the_bound_by_chance_is_exceeded_in_its_share_of_all_orders() -> None:
    x = [*range(6)]
    exact = [rank_correlation(x, [float(k) for k in order]) for order in permutations(x)]
    over = sum(each is not None and each.matters for each in exact) / len(exact)
    assert 0.02 < over < 0.07  # 5 %; an approximation, of few samples
    ten = sum(
        any(found is not None and found.matters for found in (rank_correlation(x, y, of=10) for x in many))
        for y, many in ((RNG.random(50), RNG.random((10, 50))) for _ in range(200))
    )
    assert ten / 200 < 0.05 + 3.0 * math.sqrt(0.05 * 0.95 / 200)


def test_the_indices_are_those_of_a_function_whose_variance_is_known() -> None:
    """f = x0 + 2 x1 + x0 x2 with uniform x on [-1, 1]: V = 1/3 + 4/3 + 1/9."""
    n = 2048
    points = stats.qmc.Sobol(6, seed=1).random(n) * 2.0 - 1.0
    a, b = points[:, :3], points[:, 3:]

    def f(x: np.ndarray) -> np.ndarray:
        return x[..., 0] + 2.0 * x[..., 1] + x[..., 0] * x[..., 2] + 7.0  # the constant changes nothing

    mixed = np.stack([f(np.where(np.arange(3) == j, b, a)) for j in range(3)], axis=1)
    found = sobol_indices(f(a), f(b), mixed)
    assert found is not None
    whole = 1 / 3 + 4 / 3 + 1 / 9
    first = [1 / 3 / whole, 4 / 3 / whole, 0.0]
    total = [(1 / 3 + 1 / 9) / whole, 4 / 3 / whole, 1 / 9 / whole]
    assert [each.first.value for each in found] == pytest.approx(first, abs=0.02)
    assert [each.whole.value for each in found] == pytest.approx(total, abs=0.02)
    for each, s, t in zip(found, first, total, strict=True):
        assert each.first.interval[0] - 0.01 < s < each.first.interval[1] + 0.01
        assert each.whole.interval[0] - 0.01 < t < each.whole.interval[1] + 0.01
    assert sobol_indices(np.ones(8), np.ones(8), np.ones((8, 3))) is None


@pytest.mark.parametrize(("less", "more"), [(0, 0), (0, 5), (5, 0), (3, 4), (10, 2), (40, 60)])
def test_mcnemars_test_is_the_binomial_one(less: int, more: int) -> None:
    expected = stats.binomtest(less, less + more).pvalue if less + more else 1.0
    assert two_sided(less, more) == pytest.approx(expected)
    assert binomial_tail(less, less + more) == pytest.approx(stats.binom.cdf(less, less + more, 0.5))


def test_the_interval_of_a_shift_covers_the_median_as_often_as_it_says() -> None:
    covered = 0
    for _ in range(400):
        low, high = shift([*RNG.exponential(1.0, 25)]).interval
        covered += low <= math.log(2.0) <= high
    assert covered / 400 > 0.92  # at least 95 %, but for chance: 3 standard deviations
    assert shift([0.3]).interval == (-math.inf, math.inf)
    found = shift([-0.2, -0.1, 0.0, 0.5])
    assert (found.median, found.less, found.more) == (pytest.approx(-0.05), 2, 1)


def test_quantiles_are_interpolated() -> None:
    assert quantiles([4.0, 0.0, 2.0, 1.0, 3.0]) == pytest.approx((0.0, 0.2, 1.0, 2.0, 3.0, 3.8, 4.0))
