"""Budgets on a clock of the test."""

from __future__ import annotations

import random
import time

from manipcli.live.budget import SHARE, Budget, Share


def test_offenders_together_use_their_share_of_the_time_however_many_they_are() -> None:
    draw = random.Random(0)
    for clients in (1, 8, 32):
        share, until = Share(), [0.0] * clients
        used = 0.0
        longest = 0.0
        while (now := min(until)) < 100.0:
            cost = draw.choice([1e-5, 1e-3, 0.1])
            used += cost
            wait = share.wait(now, cost)
            longest = max(longest, wait)
            until[until.index(now)] = now + wait
        assert 0.9 * SHARE < used / 100.0 < 1.1 * SHARE
        assert longest <= clients * 0.1 / SHARE + 1e-9  # each has at most one frame that is not paid for


def test_a_budget_allows_its_burst_and_then_its_rate() -> None:
    budget, start = Budget(10.0, 100.0), time.monotonic()
    assert sum(budget.spend(start) for _ in range(200)) == 100
    assert sum(budget.spend(start + 2.0) for _ in range(200)) == 20
    assert not budget.spend(start + 3.0, 10 * 4096)  # counts as 11
    assert budget.spend(start + 3.0, 9 * 4096)
