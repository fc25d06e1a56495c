"""Statistics of a sweep: intervals, quantiles, rank correlations, variance-based indices, paired tests.

Sources: Wilson, Journal of the American Statistical Association 22, 1927; Saltelli et al., Computer Physics
Communications 181, 2010, equation (b) of table 2; Jansen, Computer Physics Communications 117, 1999; McNemar,
Psychometrika 12, 1947, with the exact binomial distribution.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

CONFIDENCE: Final = 0.95
"""Of all intervals and bounds."""
SHARES: Final = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""The quantiles shown of a margin."""
RESAMPLES: Final = 1000


@dataclass(frozen=True, slots=True)
class Rate:
    """A success rate: `passed` of `count`, and its Wilson interval."""

    passed: int
    count: int

    @property
    def share(self) -> float:
        return self.passed / self.count if self.count else 0.0

    @property
    def interval(self) -> tuple[float, float]:
        """Least and most rate, with z = 1.96; (0, 1) without a sample."""
        if not self.count:
            return 0.0, 1.0
        z, n, p = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2.0), self.count, self.share
        middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n)
        half = z / (1.0 + z * z / n) * math.sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n))
        least = 0.0 if self.passed == 0 else middle - half
        return least, 1.0 if self.passed == n else middle + half

    @property
    def width(self) -> float:
        least, most = self.interval
        return most - least


@dataclass(frozen=True, slots=True)
class Correlation:
    """A rank correlation: `rho`, of `count` samples, and the largest |rho| that chance explains, `bound`.

    The bound is for the largest of all correlations of a sweep, with margin and with passing: where no number matters,
    one of them exceeds it in at most 5 % of sweeps (normal approximation of Spearman's rho, Bonferroni).
    """

    rho: float
    bound: float
    count: int

    @property
    def matters(self) -> bool:
        return abs(self.rho) > self.bound


def quantiles(values: Sequence[float]) -> tuple[float, ...]:
    """The quantiles `SHARES`, by linear interpolation."""
    return tuple(float(value) for value in np.quantile(np.array(values, dtype=float), SHARES))


def ranks(values: Sequence[float]) -> Array:
    """Ranks from 1; equal values have their mean rank."""
    _, inverse, counts = np.unique(np.array(values, dtype=float), return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    mean: Array = last - (counts - 1) / 2.0
    return mean[inverse]


def rank_correlation(x: Sequence[float], y: Sequence[float], *, of: int = 1) -> Correlation | None:
    """Spearman's rank correlation; None where one of them has one value, or with fewer than 4 pairs.

    Args:
        x, y: the pairs; `-inf` is a value below all others.
        of: number of correlations among which the largest is sought.
    """
    if len(x) < 4:
        return None
    a, b = ranks(x), ranks(y)
    a, b = a - a.mean(), b - b.mean()
    size = math.sqrt(float(a @ a) * float(b @ b))
    if size == 0.0:
        return None
    z = NormalDist().inv_cdf(1.0 - (1.0 - CONFIDENCE) / (2.0 * of))
    return Correlation(float(a @ b) / size, min(1.0, z / math.sqrt(len(x) - 1)), len(x))


@dataclass(frozen=True, slots=True)
class Index:
    """A variance-based index of one number: its estimate and the bootstrap interval."""

    value: float
    interval: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Indices:
    """`first`: the share of the variance of the result that goes when this number is known; `whole`: the share that
    stays when all others are known."""

    first: Index
    whole: Index


def sobol_indices(a: Array, b: Array, mixed: Array) -> tuple[Indices, ...] | None:
    """First-order and total indices of each number; None where the result does not vary.

    With f of A (n), B (n) and AB_j (n, d), and V the variance of f(A) and f(B) together:

        S_j = mean(f(B) (f(AB_j) - f(A))) / V        T_j = mean((f(A) - f(AB_j))^2) / (2 V)
    """
    centre = float(np.concatenate([a, b]).mean())
    a, b, mixed = a - centre, b - centre, mixed - centre  # S_j has less variance about the mean
    estimates = _estimates(a, b, mixed)
    if estimates is None:
        return None
    rng = np.random.default_rng(0)
    drawn = [_estimates(a[rows], b[rows], mixed[rows]) for rows in rng.integers(0, len(a), (RESAMPLES, len(a)))]
    many = np.array([each for each in drawn if each is not None])
    least, most = np.quantile(many, [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0], axis=0)

    def index(kind: int, j: int) -> Index:
        return Index(float(estimates[kind, j]), (float(least[kind, j]), float(most[kind, j])))

    return tuple(Indices(index(0, j), index(1, j)) for j in range(mixed.shape[1]))


def _estimates(a: Array, b: Array, mixed: Array) -> Array | None:
    """First-order and total indices, (2, d)."""
    variance = float(np.concatenate([a, b]).var())
    if variance <= 0.0:
        return None
    change = mixed - a[:, None]
    return np.stack([(b[:, None] * change).mean(axis=0), 0.5 * (change**2).mean(axis=0)]) / variance


def binomial_tail(most: int, count: int) -> float:
    """The probability of at most `most` heads in `count` throws of a fair coin."""
    return float(sum(math.comb(count, k) for k in range(most + 1)) / 2**count) if most >= 0 else 0.0


def two_sided(less: int, more: int) -> float:
    """p of a sign test, exact, from the number of pairs that changed in each direction; of verdicts: McNemar's test."""
    return min(1.0, 2.0 * binomial_tail(min(less, more), less + more))


@dataclass(frozen=True, slots=True)
class Shift:
    """The change of a margin over pairs of samples.

    Attributes:
        median: of the differences.
        interval: of the median, by order statistics: free of assumptions on the distribution.
        p: of the sign test; `less` and `more` of the differences are below and above 0.
    """

    median: float
    interval: tuple[float, float]
    p: float
    less: int
    more: int
    count: int


def shift(differences: Sequence[float]) -> Shift:
    """The change of a margin from its differences, at least one."""
    found = sorted(differences)
    n = len(found)
    less, more = sum(d < 0.0 for d in found), sum(d > 0.0 for d in found)
    k = 0  # the k-th smallest and largest bound the median
    while k + 1 <= n // 2 and 2.0 * binomial_tail(k, n) <= 1.0 - CONFIDENCE:
        k += 1
    interval = (found[k - 1], found[n - k]) if k else (-math.inf, math.inf)
    return Shift(float(np.median(found)), interval, two_sided(less, more), less, more, n)
