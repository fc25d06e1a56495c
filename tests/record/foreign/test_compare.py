"""Two logs beside each other: counts and places of differences that were planted there by other hands."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.records import Message
from mcap.writer import Writer

from manipcli.record.foreign import compare
from manipcli.record.foreign.compare import compare_logs, compared_with_itself
from manipcli.record.read.compare_entries import compare_entries
from manipcli.record.read.reading import open_recording
from manipcli.report.logs.comparison import counted

T = 1203
Rewrite = Callable[..., Path]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("compare")


@pytest.fixture
def log(folder: Path, make_run: Callable[[int], Any]) -> Path:
    path = folder / "run.mcap"
    return path if path.exists() else make_run(T).write(path)


def _last_double(data: bytes, change: float) -> bytes:
    (value,) = struct.unpack_from("<d", data, len(data) - 8)
    return data[:-8] + struct.pack("<d", value + change)


@pytest.mark.slow
def test_the_same_log_in_other_chunks_is_the_same(log: Path, tmp_path: Path, rewrite_log: Rewrite) -> None:
    other = rewrite_log(log, tmp_path / "other.mcap", chunk_size=20_000)
    assert other.read_bytes() != log.read_bytes()
    for exact in (False, True):
        found = compare_logs(log, other, exact=exact)
        assert found.same
        assert found.first is None
        assert found == compared_with_itself(log)
    assert found.messages == sum(one.messages[0] for one in found.topics) > 4 * T
    assert compare_entries(open_recording(log), open_recording(other)) == ()


def test_what_is_no_ros_message_is_compared_by_its_bytes(tmp_path: Path) -> None:
    def write(name: str, changed: int, encoding: str = "json") -> Path:
        with (tmp_path / name).open("wb") as file:
            writer = Writer(file)
            writer.start(profile="", library="somebody")
            channel = writer.register_channel("/foo", encoding, writer.register_schema("Foo", "jsonschema", b"{}"))
            for k in range(10):
                writer.add_message(channel, k, b'{"a": %d}' % (k + (k == changed)), k)
            writer.finish()
        return tmp_path / name

    a = write("a.mcap", -1)
    assert compare_logs(a, write("b.mcap", -1)).same
    found = compare_logs(a, write("c.mcap", 7))
    (topic,) = found.topics
    assert (topic.different, topic.only, topic.why) == (1, [0, 0], "")
    assert found.first is not None
    assert (found.first.index, found.first.field) == (7, "(its bytes)")
    (apart,) = compare_logs(a, write("d.mcap", -1, "cbor")).topics
    assert "json/jsonschema and cbor/jsonschema" in apart.why
    assert counted(compare_logs(a, tmp_path / "d.mcap")) == "1 topic is not compared"


def _timed(path: Path, times: Iterable[int], changed: Collection[int] = (), size: int = 8, chunk: int = 100) -> Path:
    """A log of nothing but bytes at these times [ns]; some of them others than usual."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=chunk)
        writer.start(profile="", library="somebody")
        channel = writer.register_channel("/foo", "json", writer.register_schema("Foo", "jsonschema", b"{}"))
        for time in times:
            writer.add_message(channel, time, (b"b" if time in changed else b"a") * size, time)
        writer.finish()
    return path


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.integers(0, 30), min_size=1, max_size=25),
    st.lists(st.integers(0, 30), min_size=1, max_size=25),
    st.sets(st.integers(0, 30), max_size=3),
)
def test_messages_are_paired_by_their_times(
    tmp_path: Path, one: list[int], other: list[int], changed: set[int]
) -> None:
    """Against the multisets of times, however many only one log has in a row, and wherever chunks begin."""
    a, b = _timed(tmp_path / "a.mcap", sorted(one)), _timed(tmp_path / "b.mcap", sorted(other), changed)
    left, right = Counter(one), Counter(other)
    unlike = {time: count for time, count in (left & right).items() if time in changed}
    lonely = (left - right, right - left)
    for found, only in ((compare_logs(a, b), lonely), (compare_logs(b, a), lonely[::-1])):
        (topic,) = found.topics
        assert (topic.different, topic.only) == (sum(unlike.values()), [each.total() for each in only])
        first = min((*unlike, *only[0], *only[1]), default=None)
        assert (None if found.first is None else found.first.time) == (None if first is None else first / 1e9)


def test_what_only_one_log_has_is_met_in_as_few_steps_in_either(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a = _timed(tmp_path / "a.mcap", (0, 5000), chunk=1 << 20)
    b = _timed(tmp_path / "b.mcap", range(5001), chunk=1 << 20)
    alone = compare._Merge._alone
    met: list[int] = []

    def spied(self: Any, name: str, side: int, block: Any) -> None:
        met.append(len(block))
        alone(self, name, side, block)

    monkeypatch.setattr(compare._Merge, "_alone", spied)
    for first, second in ((a, b), (b, a)):
        met.clear()
        compare_logs(first, second)
        assert met == [4999]


def test_what_comes_after_the_end_of_the_other_log_does_not_wait_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two hundred chunks, of which not even three are kept."""
    long = _timed(tmp_path / "long.mcap", range(200), size=10_000, chunk=10_000)
    short = _timed(tmp_path / "short.mcap", range(3), size=10_000, chunk=10_000)
    kept: list[int] = []
    size = compare._Side.size.fget

    def spied(self: Any) -> int:
        kept.append(size(self))
        return kept[-1]

    monkeypatch.setattr(compare._Side, "size", property(spied))
    for a, b, side in ((long, short, 0), (short, long, 1)):
        kept.clear()
        (topic,) = compare_logs(a, b).topics
        assert topic.only[side] == 197
        assert 10_000 < max(kept) < 30_000


def test_one_changed_double_is_named(log: Path, tmp_path: Path, rewrite_log: Rewrite) -> None:
    def change(topic: str, one: Message) -> bytes:
        hit = topic == "/joint_states" and one.log_time == 700_000_000
        return _last_double(one.data, 0.5) if hit else one.data

    found = compare_logs(log, rewrite_log(log, tmp_path / "other.mcap", message=change))
    (topic,) = [one for one in found.topics if not one.same]
    assert (topic.name, topic.different, topic.only) == ("/joint_states", 1, [0, 0])
    first = found.first
    assert first is not None
    assert (first.time, first.field, first.index) == (0.7, "effort[copy]", 700)
    assert first.by == pytest.approx(0.5)
    (before,) = [state[-1] for state in [open_recording(log).whole().states.effort[700]]]
    assert first.a == before


def test_every_planted_difference_is_counted(log: Path, tmp_path: Path, rewrite_log: Rewrite) -> None:
    """Messages changed, left out of one log and left out of the other, at random: as many are found, where they are."""
    rng = np.random.default_rng(2)
    fate = rng.choice(["same", "changed", "left out"], size=20_000, p=[0.9, 0.07, 0.03])
    planted: dict[str, list[tuple[int, str]]] = {}
    count = iter(range(len(fate)))

    def change(topic: str, one: Message) -> bytes | None:
        what = str(fate[next(count)])
        if topic not in ("/joint_states", "/tf", "/arm/controller_state"):
            return one.data
        if what != "same":
            planted.setdefault(topic, []).append((one.log_time, what))
        return None if what == "left out" else _last_double(one.data, 1.0) if what == "changed" else one.data

    other = rewrite_log(log, tmp_path / "other.mcap", message=change, chunk_size=30_000)
    for a, b, side in ((log, other, 0), (other, log, 1)):
        found = {one.name: one for one in compare_logs(a, b).topics}
        for name, one in found.items():
            there = planted.get(name, [])
            assert one.different == sum(what == "changed" for _, what in there)
            assert one.only[side] == sum(what == "left out" for _, what in there)
            assert one.only[1 - side] == 0
            assert (None if one.first is None else one.first.time) == (min(there)[0] / 1e9 if there else None)
    assert set(planted) == {"/joint_states", "/tf", "/arm/controller_state"}


@pytest.mark.slow
def test_topics_of_one_log_alone_and_logs_that_end_earlier(log: Path, tmp_path: Path, rewrite_log: Rewrite) -> None:
    def early(topic: str, one: Message) -> bytes | None:
        return None if topic == "/contacts" or one.log_time >= 500_000_000 else one.data

    other = rewrite_log(log, tmp_path / "other.mcap", message=early)
    found = {one.name: one for one in compare_logs(other, log).topics}
    assert found["/contacts"].messages[0] == 0
    assert found["/contacts"].only[1] == found["/contacts"].messages[1] > 0
    assert found["/joint_states"].only == [0, T - 500]
    open_end = {one.name: one for one in compare_logs(other, log, open_end=True).topics}
    assert open_end["/joint_states"].same
    assert open_end["/tf"].same
    assert not open_end["/contacts"].same, "they are missing before its end"


@pytest.mark.slow
def test_what_never_finds_a_partner_does_not_fill_the_memory(
    log: Path, tmp_path: Path, rewrite_log: Rewrite, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A topic that one log lacks from the start waits for it, up to a bound."""
    small = rewrite_log(log, tmp_path / "small.mcap", chunk_size=20_000)
    lacks = rewrite_log(
        log, tmp_path / "lacks.mcap", message=lambda t, one: None if t == "/tf" else one.data, chunk_size=20_000
    )
    whole = compare_logs(small, lacks)
    kept: list[int] = []
    size = compare._Side.size.fget

    def spied(side: Any) -> int:
        kept.append(size(side))
        return kept[-1]

    monkeypatch.setattr(compare._Side, "size", property(spied))
    monkeypatch.setattr(compare, "MAX_WAITING", 200_000)
    assert compare_logs(small, lacks) == whole
    assert max(kept) < 250_000 < small.stat().st_size


def test_sequence_numbers_count_where_every_byte_does(log: Path, tmp_path: Path, rewrite_log: Rewrite) -> None:
    def change(topic: str, one: Message) -> bytes:
        one.sequence += topic == "/tf" and one.log_time == 10_000_000
        return one.data

    other = rewrite_log(log, tmp_path / "other.mcap", message=change)
    assert compare_logs(log, other).same
    first = compare_logs(log, other, exact=True).first
    assert first is not None
    assert (first.topic, first.field, first.by, first.time) == ("/tf", "(sequence number)", 1.0, 0.01)


def test_metadata_and_attachments_are_compared(log: Path, tmp_path: Path, rewrite_log: Rewrite) -> None:
    other = rewrite_log(
        log,
        tmp_path / "other.mcap",
        attachment=lambda name, data: data.replace(b"test", b"other") if name == "task.yaml" else None,
        metadata=lambda name, values: values | {"seed": "8"} if name == "run" else values,
    )
    found = compare_entries(open_recording(log), open_recording(other))
    assert [(one.kind, one.name, one.where, one.a, one.b) for one in found] == [
        ("metadata", "run", "seed", "7", "8"),
        ("attachment", "task.yaml", "line 1", "task: test", "task: other"),
        ("attachment", "plan.json", "", "0 bytes", None),
    ]
