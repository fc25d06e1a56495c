"""A stopwatch adds up what is spent in its blocks, and nothing else."""

from __future__ import annotations

import time

import pytest

from manipcli.core.stopwatch import Stopwatch


def test_blocks_are_added_up_also_those_that_raise(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([1.0, 1.5, 10.0, 12.0])
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    watch = Stopwatch()
    with watch:
        pass
    with pytest.raises(ValueError, match="inside"), watch:
        raise ValueError("inside")
    assert watch.seconds == 2.5
