"""Rate of messages from the times of their arrival."""

from __future__ import annotations

import pytest

from manipcli.live.rate import Rate


def test_the_report_has_mean_and_bounds_of_the_window() -> None:
    rate = Rate(window=4)
    for now in (0.0, 5.0, 5.1, 5.3, 5.4):
        rate.arrived(now)
    numbers = [float(word.rstrip("s")) for word in rate.report().split() if word[0].isdigit()]
    assert numbers == pytest.approx([3 / 0.4, 0.1, 0.2, 0.04714, 4], abs=1e-3)


def test_without_two_messages_or_a_new_one_there_is_no_rate() -> None:
    rate = Rate(window=10)
    assert rate.report() == "no new messages"
    rate.arrived(1.0)
    assert rate.report() == "no new messages"
    rate.arrived(2.0)
    assert rate.report().startswith("average rate: 1.000\n")
    assert rate.report() == "no new messages"
