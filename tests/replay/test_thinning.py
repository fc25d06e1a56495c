"""Thinning: never over the budget, evenly, with the first measurement of each interval."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.replay.thinning import Budget, Thinned


def _kept(times: np.ndarray, size: int, most: int) -> tuple[list[float], Budget]:
    budget = Budget(0.1, most)
    series: Thinned[float] = Thinned(budget)
    for time in times.tolist():
        if series.wants(time):
            series.add(time, size, time)
    assert all(time == value for time, value in series)
    return [time for time, _ in series], budget


@pytest.mark.parametrize(("rate", "most"), [(25.0, 10_000), (25.0, 50), (1000.0, 7), (3.0, 10_000), (40.0, 1)])
def test_kept_are_the_first_ones_of_intervals_within_the_budget(rate: float, most: int) -> None:
    times = np.arange(400) / rate
    kept, budget = _kept(times, 1, most)
    assert len(kept) <= most
    # Oracle: brute force at the interval in the end.
    number = np.floor(times / budget.interval + 1e-6)
    assert kept == [times[number == k][0] for k in np.unique(number)]
    # No coarser than the budget needs: at half the interval it would be exceeded.
    assert budget.interval == 0.1 or len(np.unique(np.floor(times / (budget.interval / 2) + 1e-6))) > most


def test_the_order_of_the_file_does_not_matter_without_thinning() -> None:
    times = np.arange(0.0, 5.0, 0.1)
    kept, _ = _kept(np.random.default_rng(1).permutation(times), 1, 1000)
    assert kept == times.tolist()


def test_series_share_a_budget_and_one_measurement_of_each_stays() -> None:
    budget = Budget(0.1, 10)
    series = [Thinned[int](budget) for _ in range(3)]
    for step in range(200):
        for one in series:
            if one.wants(step / 10):
                one.add(step / 10, 100, step)
    assert [len(one) for one in series] == [1, 1, 1]
