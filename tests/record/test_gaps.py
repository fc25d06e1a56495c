"""Gaps of a log: a hole that is cut out is found, and where nothing is missing there is none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.record.foreign.repair import repair
from manipcli.record.foreign.topics import open_topics
from manipcli.record.gaps import MOST, Intervals, common, gaps_text
from manipcli.record.read.reading import open_recording
from manipcli.record.read.scan import Scan
from manipcli.record.records import CHUNK
from manipcli.record.write import recorder
from manipcli.replay.display_sampling import sampled


def _intervals(times: np.ndarray, parts: int = 1) -> Intervals:
    found = Intervals()
    for part in np.array_split(times, parts):
        if len(part):
            found.add(part)
    return found


@settings(max_examples=30)
@given(
    st.sampled_from([1, 2, 10, 20, 100]),
    st.floats(0.0, 0.4),
    st.lists(st.integers(1, 8), max_size=4, unique=True),
    st.integers(1, 7),
    st.integers(0, 2**32 - 1),
)
def test_the_holes_that_were_cut_are_the_gaps(
    milliseconds: int, jitter: float, holes: list[int], parts: int, seed: int
) -> None:
    """A topic of ten times two seconds with a steady rate, and some of these two seconds half empty."""
    period = milliseconds * 1_000_000
    grid = np.arange(0, 20_000_000_000, period)
    times = grid + (np.random.default_rng(seed).uniform(0.0, jitter, len(grid)) * period).astype(np.int64)
    cut = np.isin(times // 2_000_000_000, holes) & (times % 2_000_000_000 < 1_000_000_000)
    there = times[~cut]
    gaps = _intervals(there, parts).gaps()
    assert len(gaps) == len(holes)
    for (start, end), hole in zip(gaps, sorted(holes), strict=True):
        assert {start, end} <= set(there.tolist())
        assert start < hole * 2_000_000_000 <= end - 1_000_000_000 + period
        assert not ((there > start) & (there < end)).any()


def test_a_topic_without_a_rate_has_no_gaps() -> None:
    """Events come when they come: one in ten of the intervals may be as long as a gap."""
    random = np.random.default_rng(1)
    events = np.cumsum(random.exponential(0.5e9, 400)).astype(np.int64)
    assert len(_intervals(events).gaps()) <= 2
    assert _intervals(np.arange(10) * 10**9).gaps() == ()


def test_memory_is_bounded_and_the_longest_gaps_remain() -> None:
    lengths = np.full(60_000, 1_000_000)
    lengths[::300] = 10**9 + 10**6 * np.arange(200)
    gaps = _intervals(np.cumsum(lengths), 50).gaps()
    assert len(gaps) == MOST
    assert min(end - start for start, end in gaps) == np.sort(lengths)[-MOST]


def test_many_gaps_are_counted() -> None:
    assert gaps_text(((1.0, 2.0),)) == "1.00 to 2.00 s"
    assert gaps_text(tuple((float(k), k + 0.5) for k in range(5))).endswith("2.00 to 2.50 s and 2 more")


def test_a_hole_in_a_log_is_a_gap_of_its_playback_and_its_topics(
    tmp_path: Path, make_run: Callable[[int], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ticks 150 to 349 of 500 are overwritten, and the file is repaired."""
    monkeypatch.setattr(recorder, "BLOCK_SECONDS", 0.05)
    whole = make_run(500).write(tmp_path / "whole.mcap")
    assert open_topics(whole).gaps == ()
    chunks = [record for record in Scan(whole) if getattr(record, "opcode", 0) == CHUNK]
    data = bytearray(whole.read_bytes())
    for chunk in chunks[3:7]:
        data[chunk.offset + 60 : chunk.end] = bytes(chunk.end - chunk.offset - 60)
    (tmp_path / "bad.mcap").write_bytes(data)
    repair(tmp_path / "bad.mcap", tmp_path / "good.mcap", overwrite=True)
    recording = open_recording(tmp_path / "good.mcap")
    ticks = np.concatenate([span.states.time for span in recording.spans])
    k = int(np.argmax(np.diff(ticks)))
    assert ticks[k + 1] - ticks[k] > 0.15
    span, _, gaps = sampled(recording, rate=50.0) or pytest.fail("nothing is recorded")
    assert gaps == ((ticks[k], ticks[k + 1]),)
    assert {ticks[k], ticks[k + 1]} <= set(span.states.time)
    (gap,) = open_topics(tmp_path / "good.mcap").gaps
    assert (gap.start / 1e9, gap.end / 1e9) == gaps[0]
    assert {"/joint_states", "/tf"} <= set(gap.topics)


def test_a_common_gap_is_one_of_all() -> None:
    one, other = ((1.0, 2.0), (4.0, 6.0)), ((1.5, 3.0), (4.5, 5.0), (5.5, 7.0))
    assert common(one) == one
    assert common(one, other) == common(other, one) == ((1.5, 2.0), (4.5, 5.0), (5.5, 6.0))
    assert common(one, other, ()) == ()
