"""Where the messages of a chunk stand: an index is believed where every message agrees with it, and nowhere else."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from manipcli.record import schemas
from manipcli.record.cdr import CdrError
from manipcli.record.read.chunk import Places, indexed, walked
from manipcli.record.read.columns import Columns, NamedRuns, joint_state_runs

HEAD = struct.Struct("<BQHIQQ")
"""MCAP: opcode, length, channel, sequence, log time, publish time; the length counts what follows it."""
Message = tuple[int, int, bytes]
"""Channel, log time [ns] and payload."""
MESSAGES: list[Message] = [(3, 10, b"abcdefgh"), (7, 10, b""), (3, 20, b"ij")]


def chunk(messages: list[Message]) -> tuple[bytes, dict[int, list[tuple[int, int]]]]:
    """The bytes of a chunk, and its message indexes: channel -> (log time, offset)."""
    data, index = b"", {}
    for channel, time, payload in messages:
        index.setdefault(channel, []).append((time, len(data)))
        data += HEAD.pack(5, 22 + len(payload), channel, 0, time, time) + payload
    return data, index


def packed(index: dict[int, list[tuple[int, int]]]) -> dict[int, bytes]:
    return {channel: b"".join(struct.pack("<QQ", *pair) for pair in pairs) for channel, pairs in index.items()}


def test_messages_are_where_the_index_says_and_a_walk_finds_the_same() -> None:
    data, index = chunk(MESSAGES)
    found, (walk, others) = indexed(data, packed(index)), walked(data)
    assert found is not None
    assert others == []
    for places in (found, walk):
        assert {channel: one.times.tolist() for channel, one in places.items()} == {3: [10, 20], 7: [10]}
        payloads = {
            channel: [data[at : at + size] for at, size in zip(one.starts, one.lengths, strict=True)]
            for channel, one in places.items()
        }
        assert payloads == {3: [b"abcdefgh", b"ij"], 7: [b""]}


@pytest.mark.parametrize(
    "spoilt",
    [
        {3: [(10, 0), (21, 70)], 7: [(10, 39)]},  # another time
        {3: [(10, 0), (10, 39)], 7: [(20, 70)]},  # each the other's message
        {3: [(10, 1), (20, 70)], 7: [(10, 39)]},  # beside its beginning
        {3: [(10, 0), (20, 2**40)], 7: [(10, 39)]},  # beyond the end
        {3: [(10, 0)], 7: [(10, 39)]},  # one that is not indexed
        {3: [(10, 0), (10, 0), (20, 70)], 7: [(10, 39)]},  # one twice
        {},
    ],
)
def test_an_index_that_does_not_agree_is_not_believed(spoilt: dict[int, list[tuple[int, int]]]) -> None:
    data, index = chunk(MESSAGES)
    assert index == {3: [(10, 0), (20, 70)], 7: [(10, 39)]}
    wrong = len(data) - 2  # where the last one's payload begins
    assert data[wrong:] == b"ij"
    assert indexed(data, packed(spoilt)) is None


@pytest.mark.parametrize(("at", "value"), [(0, 4), (70, 6)])
def test_a_record_of_another_kind_is_no_message(at: int, value: int) -> None:
    data, index = chunk(MESSAGES)
    spoilt = bytearray(data)
    spoilt[at] = value
    assert indexed(bytes(spoilt), packed(index)) is None


def test_a_message_is_no_longer_than_its_chunk() -> None:
    data, index = chunk(MESSAGES)
    for length in (2**40, 21, 0):
        spoilt = bytearray(data)
        spoilt[1:9] = struct.pack("<Q", length)
        assert indexed(bytes(spoilt), packed(index)) is None
        if length != 21:
            with pytest.raises(CdrError):
                walked(bytes(spoilt))


def test_of_some_channels_the_others_need_not_be_known() -> None:
    data, index = chunk(MESSAGES)
    (channel,) = indexed(data, packed({7: index[7]}), whole=False) or {}
    assert channel == 7
    assert indexed(data, packed({7: index[7]})) is None


@pytest.mark.parametrize(("first", "second", "named"), [([10, 10], [], 10), ([10, 20], [20], 20), ([10, 5], [], 10)])
def test_of_one_channel_each_message_is_later_than_the_one_before(
    first: list[int], second: list[int], named: int
) -> None:
    data = bytes([0, 1, 0, 0, 1, 0, 0, 0, 0])  # an empty text
    columns = Columns("/x", schemas.STRING, lambda _, __: NamedRuns((), ()), (), ())
    with pytest.raises(CdrError, match=f"time runs backwards in /x after t = {named:.3f} s"):
        for times in (first, second):
            at = np.zeros(len(times), dtype=np.int64)
            columns.add(data, Places(np.array(times, dtype=np.int64) * 10**9, at, at + 9))


def test_a_message_that_is_cut_takes_nothing_from_the_next() -> None:
    """Names and counts are those of the others; the last number would lie behind its end."""
    store = get_typestore(Stores.ROS2_JAZZY)
    kinds = store.types
    stamp = kinds["builtin_interfaces/msg/Time"](sec=1, nanosec=0)
    header = kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="")
    joint_state = kinds["sensor_msgs/msg/JointState"]
    message = joint_state(header=header, name=["a"], position=np.ones(1), velocity=np.ones(1), effort=np.full(1, 3.0))
    one = bytes(store.serialize_cdr(message, "sensor_msgs/msg/JointState"))
    times, starts = np.array([1, 2, 3]) * 10**9, np.arange(3) * len(one)
    for lengths, whole in (([0, 0, 0], True), ([0, -8, 0], False), ([0, 0, -1], False), ([-8, -8, -8], False)):
        columns = Columns("/joint_states", schemas.JOINT_STATE, joint_state_runs, ("a",), (1, 1, 1))
        places = Places(times, starts, np.array(lengths) + len(one))
        if not whole:
            with pytest.raises(CdrError, match="ends too early"):
                columns.add(3 * one, places)
            continue
        columns.add(3 * one, places)
        np.testing.assert_array_equal(columns.take(3)[1][2], np.full((3, 1), 3.0))
