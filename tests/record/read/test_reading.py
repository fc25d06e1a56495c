"""What was written is read back; what was cut is read as far as it goes; what was changed is refused."""

from __future__ import annotations

import itertools
import json
import struct
import tracemalloc
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk, Message, MessageIndex
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.core.activity import announced_to
from manipcli.core.errors import ExitCode
from manipcli.model.state import WorldState
from manipcli.record.faults import BadRecording, Thinned
from manipcli.record.read.differences import body_velocities
from manipcli.record.read.reading import open_recording, read_recording
from manipcli.record.recording import Recording
from manipcli.record.write import recorder as recorder_module

MakeRun = Callable[[int], Any]
Rewrite = Callable[..., Path]
MAGIC = b"\x89MCAP0\r\n"
ARRAYS = ("time", "position", "velocity", "effort", "body_position", "body_quat_xyzw", "body_linear", "body_angular")


def assert_same(one: Recording, other: Recording, *, ticks: int | None = None) -> None:
    """Equal, or `one` is the first `ticks` of `other` (but for velocities at the cut, which are one-sided)."""
    for name in ARRAYS if ticks is None else ARRAYS[:6]:
        expected = getattr(other.states, name)
        np.testing.assert_array_equal(getattr(one.states, name), expected if ticks is None else expected[:ticks])
    for ours, theirs in zip(one.controllers, other.controllers, strict=True):
        for name in ("times", "reference_position", "reference_velocity", "position", "output"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name)[: len(ours.times)])
    if ticks is None:
        assert one.contacts == other.contacts
        assert one.events == other.events
        assert one.attachments == other.attachments
        assert one.metadata == other.metadata
    else:
        end = ticks * one.period - 1e-9
        assert one.contacts == tuple(change for change in other.contacts if change.time < end)
        happened = sum(event.time < end for event in other.events)  # those of the cut itself may be there
        assert one.events == other.events[: max(happened, len(one.events))]


@pytest.fixture
def small(tmp_path: Path, make_run: MakeRun, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Path]:
    """A log of 40 ticks in five chunks."""
    monkeypatch.setattr(recorder_module, "BLOCK_SECONDS", 0.01)
    run = make_run(40)
    return run, run.write(tmp_path / "small.mcap")


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(opcode, begin, end) of each record at the top of an MCAP file."""
    offset = len(MAGIC)
    while offset < len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, offset)
        yield opcode, offset, offset + 9 + length
        offset += 9 + length


def test_reads_back_what_was_recorded(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(1203)
    recording = read_recording(run.write(tmp_path / "run.mcap"))
    assert recording.lost is None
    assert recording.period == 0.001
    assert recording.joint_names == run.robot.joint_names
    assert recording.body_names == ("cup", "ball")
    for name in ARRAYS[1:6]:
        np.testing.assert_array_equal(getattr(recording.states, name), getattr(run.states, name))
    # Times are whole nanoseconds: exact to half of one.
    np.testing.assert_allclose(recording.states.time, run.states.time, rtol=0, atol=0.5e-9)
    arm, hand = recording.controllers
    assert (arm.name, arm.joints, hand.name, hand.joints) == ("arm", ("shoulder", "slide"), "hand", ("spin",))
    for trace, output, columns in ((arm, run.outputs[0], [0, 1]), (hand, run.outputs[1], [2])):
        np.testing.assert_array_equal(trace.reference_position, output[0])
        np.testing.assert_array_equal(trace.reference_velocity, output[1])
        np.testing.assert_array_equal(trace.position, run.states.position[:, columns])
        np.testing.assert_array_equal(trace.output, output[3])
        np.testing.assert_array_equal(trace.times, recording.states.time)
    assert [snapshot.time for snapshot in recording.contacts] == [k / 10 for k in range(13)]
    assert recording.contacts[0].contacts == ()
    assert recording.contacts[1].contacts == run.contacts
    assert recording.silent == ()
    assert [(event.time, event.step, event.text) for event in recording.events] == [
        (k / 4, f"step_{250 * k}", "é ok") for k in range(5)
    ]
    assert recording.attachments == {"task.yaml": b"task: test\n", "plan.json": b""}
    assert recording.metadata["run"] == {"task": "test", "seed": "7"}
    assert recording.metadata["verdict"] == {"verdict": "passed"}
    with pytest.raises(ValueError, match="read-only"):
        recording.states.position[0, 0] = 1.0


def test_spans_are_the_chunks_of_the_file_and_their_velocities_know_no_seams(small: tuple[Any, Path]) -> None:
    """Oracle for the velocities: the same differences over all ticks at once."""
    _, path = small
    recording = open_recording(path)
    for _ in range(2):
        assert [len(span.states.time) for span in recording.spans] == [10, 10, 10, 10]
    assert_same(recording, read_recording(path))
    whole = recording.states
    linear, angular = body_velocities(whole.time, whole.body_position, whole.body_quat_xyzw)
    np.testing.assert_array_equal(whole.body_linear, linear)
    np.testing.assert_array_equal(whole.body_angular, angular)
    for span in recording.spans:
        with pytest.raises(ValueError, match="read-only"):
            span.states.body_linear[0, 0] = 1.0


@pytest.mark.slow
def test_going_through_a_recording_takes_memory_for_a_few_spans(tmp_path: Path, make_run: MakeRun) -> None:
    """A chunk of half a second is 0.9 MB here; the ticks alone of three times as long a run would be 3 MB more."""
    run = make_run(500)
    peaks = []
    for repeats in (8, 24):
        recorder = run.recorder(tmp_path / f"{repeats}.mcap", metadata={})
        for k in range(repeats):
            for tick in range(500):
                one = run.states.map(lambda a, tick=tick: a[tick])
                recorder.tick(500 * k + tick, one, run.outputs_at(tick))
        recorder.finish({})
        tracemalloc.start()
        ticks = sum(len(span.states.time) for span in open_recording(tmp_path / f"{repeats}.mcap").spans)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert ticks == 500 * repeats
    assert peaks[1] < peaks[0] + 200_000


def test_a_file_that_shrinks_between_two_readings_is_refused(small: tuple[Any, Path]) -> None:
    _, path = small
    recording = open_recording(path)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(BadRecording, match="changed while it was read"):
        list(recording.spans)


def test_controllers_are_recorded_at_every_tick_or_the_file_is_refused(
    small: tuple[Any, Path], tmp_path: Path, rewrite_log: Rewrite
) -> None:
    _, path = small

    def all_but_one(topic: str, one: Message) -> bytes | None:
        return None if topic == "/arm/controller_state" and one.log_time == 7_000_000 else one.data

    rewrite_log(path, tmp_path / "copy.mcap", message=all_but_one)
    with pytest.raises(BadRecording, match="filtered by another program"):
        read_recording(tmp_path / "copy.mcap")


def test_a_flushed_recording_is_read_while_it_is_written(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(620)
    recorder = run.recorder(tmp_path / "run.mcap")
    run.feed(recorder)
    recorder.metadata("run", {"status": "complete"})
    flushed = read_recording(recorder.partial_path, being_written=True)
    assert flushed.lost is None
    assert flushed.metadata["run"] == {"task": "test", "seed": "7", "status": "complete"}
    assert read_recording(recorder.partial_path).lost == "the file is not finished; recorded until t = 0.619 s"
    recorder.finish({})
    assert not recorder.partial_path.exists()
    assert_same(read_recording(tmp_path / "run.mcap"), flushed)


def test_a_killed_run_loses_at_most_its_last_two_blocks(tmp_path: Path, make_run: MakeRun) -> None:
    """Nothing is buffered between flushes but the block that fills and the one that a thread compresses and writes, so
    stopping to write is all that a kill does."""
    run = make_run(1203)
    recorder = run.recorder(tmp_path / "run.mcap")
    run.feed(recorder)
    recording = read_recording(recorder.partial_path)
    ticks = len(recording.states.time)
    assert ticks in (500, 1000)
    assert recording.lost == f"the file is not finished; recorded until t = {(ticks - 1) / 1000:.3f} s"
    recorder.close_partial()
    whole = read_recording(recorder.partial_path)
    assert len(whole.states.time) == 1203
    assert_same(recording, whole, ticks=ticks)
    assert len(recording.contacts) > 4


@pytest.mark.slow
def test_truncated_anywhere_a_prefix_is_read(small: tuple[Any, Path], tmp_path: Path) -> None:
    _, path = small
    data = path.read_bytes()
    whole = read_recording(path)
    tops = list(records(data))
    layout_end = next(end for opcode, start, end in tops if opcode == 0x0C and b"bodies" in data[start:end])
    chunk_ends = [end for opcode, _, end in tops if opcode == 0x06]
    cuts = {size for _, start, end in tops for size in (start, start + 1, start + 9, (start + end) // 2, end - 1, end)}
    cuts |= set(range(0, len(data), 997)) | set(range(len(data) - 40, len(data), 3))
    cut_path = tmp_path / "cut.mcap"
    for size in sorted(cuts):
        cut_path.write_bytes(data[:size])
        if size == len(data):
            continue
        if size < layout_end:
            with pytest.raises(BadRecording):
                read_recording(cut_path)
            continue
        recording = read_recording(cut_path)
        chunks = sum(end <= size for end in chunk_ends)
        ticks = min(10 * max(chunks - 1, 0), 40)
        assert len(recording.states.time) == ticks
        assert recording.lost is not None
        assert_same(recording, whole, ticks=ticks)


@pytest.mark.slow
def test_a_single_flipped_bit_is_noticed_anywhere(small: tuple[Any, Path], tmp_path: Path) -> None:
    _, path = small
    data = path.read_bytes()
    tail = range(len(data) - 60, len(data))
    end_of_data = next(end for opcode, _, end in records(data) if opcode == Opcode.DATA_END)
    heads = [start + k for _, start, _ in records(data) for k in (0, 1, 5)]
    flipped_path = tmp_path / "flipped.mcap"
    for position in {*range(0, len(data), 397), *heads, *tail}:
        flipped = bytearray(data)
        flipped[position] ^= 1 << (position % 8)
        flipped_path.write_bytes(flipped)
        told: list[str] = []
        try:
            with announced_to(told.append):
                recording = read_recording(flipped_path)
        except BadRecording:
            continue
        assert recording.lost is not None or told, f"bit {position % 8} of byte {position}"
        if told:
            assert position >= end_of_data, "the rest has its own checksums"


def _other_name(message: Any) -> None:
    names = message.joint_names if hasattr(message, "joint_names") else message.name
    names[0], names[1] = names[1], names[0]


def _narrow(message: Any) -> None:
    where = message.reference if hasattr(message, "reference") else message
    field = "positions" if hasattr(where, "positions") else "position"
    setattr(where, field, getattr(where, field)[:-1])


@pytest.mark.parametrize("every", [True, False])
@pytest.mark.parametrize(
    ("topic", "change", "told"),
    [
        ("/joint_states", _other_name, "has other joints or bodies than the metadata"),
        ("/joint_states", _narrow, "has different numbers of values and names"),
        ("/arm/controller_state", _other_name, "has other joints or bodies than the metadata"),
        ("/arm/controller_state", _narrow, "has different numbers of values and names"),
    ],
)
def test_a_message_of_other_joints_or_widths_is_refused_with_its_topic(
    small: tuple[Any, Path],
    tmp_path: Path,
    rewrite_log: Callable[..., Path],
    topic: str,
    change: Callable[[Any], None],
    told: str,
    every: bool,
) -> None:
    """Whether one says so or all of a chunk do."""
    schemas = {}
    with small[1].open("rb") as file:
        summary = make_reader(file).get_summary()
        assert summary is not None
        for channel in summary.channels.values():
            schemas[channel.topic] = summary.schemas[channel.schema_id]
    schema = schemas[topic]
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema.data.decode(), schema.name))

    def rewritten(where: str, one: Message) -> bytes:
        if where != topic or not (every or one.log_time == 15_000_000):
            return one.data
        message = store.deserialize_cdr(one.data, schema.name)
        change(message)
        return bytes(store.serialize_cdr(message, schema.name))

    with pytest.raises(BadRecording, match=f"{topic} .*{told}"):
        read_recording(rewrite_log(small[1], tmp_path / "other.mcap", message=rewritten))


def test_a_damaged_chunk_is_named_by_place_and_time(small: tuple[Any, Path], tmp_path: Path) -> None:
    _, path = small
    data = bytearray(path.read_bytes())
    _, start, end = [record for record in records(data) if record[0] == 0x06][2]
    data[end - 40] ^= 1
    (tmp_path / "bad.mcap.partial").write_bytes(data[: end + 20])
    with pytest.raises(BadRecording, match=rf"chunk at byte {start} \(t = 0\.010 to 0\.019 s\) is damaged") as caught:
        read_recording(tmp_path / "bad.mcap.partial")
    assert caught.value.exit_code is ExitCode.USAGE
    assert str(tmp_path) not in caught.value.findings[0].message


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("index_types", [IndexType.ALL, IndexType.NONE])
def test_another_writer_s_copy_reads_the_same(
    small: tuple[Any, Path],
    tmp_path: Path,
    rewrite_log: Rewrite,
    compression: CompressionType,
    index_types: IndexType,
) -> None:
    """The mcap library's writer: other chunks, channels inside them, with and without indexes and checksums."""
    _, path = small
    rewrite_log(path, tmp_path / "copy.mcap", chunk_size=7000, compression=compression, index_types=index_types)
    assert_same(read_recording(tmp_path / "copy.mcap"), read_recording(path))


def test_messages_of_changing_length_are_read_one_by_one(
    tmp_path: Path, small: tuple[Any, Path], rewrite_log: Rewrite
) -> None:
    """Two robots' worth of frames in one /tf channel: sizes differ, the bodies' numbers are found all the same."""
    _, path = small
    number = itertools.count()

    def longer(topic: str, one: Message) -> bytes:
        return one.data + bytes(8 * (next(number) % 3)) if topic in ("/tf", "/joint_states") else one.data

    rewrite_log(path, tmp_path / "copy.mcap", message=longer)
    ours, theirs = read_recording(path), read_recording(tmp_path / "copy.mcap")
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(ours.states, name), getattr(theirs.states, name))


def with_records(path: Path, *extra: bytes, keep: Callable[[int], bool] = lambda opcode: True) -> Path:
    """The unfinished head of a log (everything before its first chunk) and then `extra`."""
    data = path.read_bytes()
    head = [data[: len(MAGIC)]]
    for opcode, start, end in records(data):
        if opcode == 0x06:
            break
        if keep(opcode):
            head.append(data[start:end])
    made = path.with_name("made.mcap.partial")
    made.write_bytes(b"".join([*head, *extra]))
    return made


def chunk(packed: bytes, size: int, compression: str = "zstd", crc: int = 0) -> bytes:
    name = compression.encode()
    body = struct.pack("<QQQII", 0, 0, size, crc, len(name)) + name + struct.pack("<Q", len(packed)) + packed
    return struct.pack("<BQ", 6, len(body)) + body


class TestBounds:
    def test_declared_size(self, small: tuple[Any, Path]) -> None:
        with pytest.raises(BadRecording, match=r"declares 6442450944 bytes"):
            read_recording(with_records(small[1], chunk(b"x" * 197_000, 6 << 30)))

    @pytest.mark.parametrize("content", [bytes(60 << 20), b"\x03\1" + bytes(7) + b"\0"], ids=["nothing", "schemas"])
    def test_what_unpacks_to_much_that_is_no_message(self, small: tuple[Any, Path], content: bytes) -> None:
        """No more than the chunk itself is held."""
        import zstandard

        content = content * ((60 << 20) // len(content))
        made = with_records(small[1], chunk(zstandard.compress(content), len(content)))
        tracemalloc.start()
        with pytest.raises(BadRecording, match=r"too many records that are not messages"):
            read_recording(made)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 1 << 27

    @pytest.mark.parametrize("compression", ["zstd", "lz4"])
    def test_a_chunk_larger_than_it_says(self, small: tuple[Any, Path], compression: str) -> None:
        import lz4.frame
        import zstandard

        big = bytes(200 << 20)
        packed = zstandard.compress(big) if compression == "zstd" else lz4.frame.compress(big)
        del big
        path = with_records(small[1], chunk(packed, 1000, compression))
        tracemalloc.start()
        with pytest.raises(BadRecording, match=r"is damaged"):
            read_recording(path)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 20 << 20

    def test_record_length(self, small: tuple[Any, Path]) -> None:
        with pytest.raises(BadRecording, match=r"declares 4611686018427387904 bytes, the limit is"):
            read_recording(with_records(small[1], struct.pack("<BQ", 6, 1 << 62)))

    def test_number_of_channels(self, small: tuple[Any, Path]) -> None:
        record = struct.pack("<BQHHIII", 4, 16, 9, 0, 0, 0, 0)
        with pytest.raises(BadRecording, match=r"more than 4096"):
            read_recording(with_records(small[1], record * 5000))

    def test_unknown_compression(self, small: tuple[Any, Path]) -> None:
        with pytest.raises(BadRecording, match=r"is damaged"):
            read_recording(with_records(small[1], chunk(b"x", 1, "rar")))

    def test_message_that_leaves_its_chunk(self, small: tuple[Any, Path]) -> None:
        data = struct.pack("<BQ", 5, 1000) + bytes(50)
        with pytest.raises(BadRecording, match=r"ends too early"):
            read_recording(with_records(small[1], chunk(data, len(data), "", zlib.crc32(data))))

    def test_sequence_longer_than_its_message(self, small: tuple[Any, Path]) -> None:
        cdr = b"\x00\x01\x00\x00" + struct.pack("<iI", 0, 0) + struct.pack("<I", 1) + bytes(4) + b"\xff\xff\xff\x7f"
        data = struct.pack("<BQHIQQ", 5, 22 + len(cdr), 4, 1, 0, 0) + cdr
        with pytest.raises(BadRecording, match=r"ends too early"):
            read_recording(with_records(small[1], chunk(data, len(data), "", zlib.crc32(data))))


class TestWhoseFile:
    @pytest.mark.parametrize(
        ("data", "cause"),
        [
            (b"", "the file is empty"),
            (b"garbage" * 100, "not an MCAP file"),
            (MAGIC[:5], "not an MCAP file"),
            (MAGIC, "no metadata record"),
        ],
    )
    def test_other_bytes(self, tmp_path: Path, data: bytes, cause: str) -> None:
        (tmp_path / "x.mcap").write_bytes(data)
        with pytest.raises(BadRecording, match=cause):
            read_recording(tmp_path / "x.mcap")

    def test_no_file_and_directory(self, tmp_path: Path) -> None:
        with pytest.raises(BadRecording, match=r"No such file") as caught:
            read_recording(tmp_path / "x.mcap")
        assert str(caught.value.findings[0].place) == str(tmp_path / "x.mcap")
        with pytest.raises(BadRecording, match=r"directory"):
            read_recording(tmp_path)

    def test_somebody_else_s_log(self, tmp_path: Path) -> None:
        with (tmp_path / "x.mcap").open("wb") as file:
            writer = Writer(file)
            writer.start(profile="ros2")
            schema = writer.register_schema("a/msg/B", "jsonschema", b"{}")
            channel = writer.register_channel("/a", "json", schema)
            writer.add_message(channel, 0, json.dumps({"a": 1}).encode(), 0)
            writer.finish()
        with pytest.raises(BadRecording, match=r"not a recording of manipcli"):
            read_recording(tmp_path / "x.mcap")

    def test_missing_topics_are_named(self, small: tuple[Any, Path]) -> None:
        path = with_records(small[1], keep=lambda opcode: opcode != 0x04)
        with pytest.raises(BadRecording, match=r"missing /joint_states \(sensor_msgs/msg/JointState\), /tf"):
            read_recording(path)

    def test_later_format(self, small: tuple[Any, Path]) -> None:
        data = small[1].read_bytes()
        small[1].write_bytes(data.replace(b"format\x01\x00\x00\x002", b"format\x01\x00\x00\x004"))
        with pytest.raises(BadRecording, match=r"has format 4; this manipcli reads up to 3"):
            read_recording(small[1])


def test_attachment_names_lose_their_directories(small: tuple[Any, Path]) -> None:
    def attachment(name: bytes) -> bytes:
        body = struct.pack("<QQI", 0, 0, len(name)) + name + struct.pack("<I", 0) + struct.pack("<Q", 2) + b"hi"
        return struct.pack("<BQ", 9, len(body) + 4) + body + struct.pack("<I", zlib.crc32(body))

    path = with_records(small[1], attachment(b"../../../../tmp/pwn.txt"))
    assert read_recording(path).attachments["pwn.txt"] == b"hi"
    for name in (b"..", b"a/..", b"/", b"x/task.yaml"):
        with pytest.raises(BadRecording, match=r"missing or duplicate name"):
            read_recording(with_records(small[1], attachment(name)))


def test_time_running_backwards_is_refused(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(20)
    recorder = run.recorder(tmp_path / "run.mcap")
    run.feed(recorder)
    run.feed(recorder, 0, 5)
    recorder.finish({})
    with pytest.raises(BadRecording, match=r"time runs backwards in /joint_states after t = 0\.019 s"):
        read_recording(tmp_path / "run.mcap")


def test_chunks_hold_indexes_that_cover_every_message(small: tuple[Any, Path]) -> None:
    """The fast way through a file of ours is taken: indexes account for each byte of each chunk."""
    from manipcli.record.read.chunk import indexed, walked

    pending: Chunk | None = None
    indexes: dict[int, bytes] = {}
    seen = 0
    with small[1].open("rb") as file:
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, MessageIndex):
                indexes[record.channel_id] = np.array(record.records, dtype="<u8").tobytes()
                continue
            if pending is not None:
                import zstandard

                data = zstandard.decompress(pending.data)
                fast, (slow, others) = indexed(data, indexes), walked(data)
                assert fast is not None
                assert others == []
                assert fast.keys() == slow.keys()
                for channel, places in fast.items():
                    np.testing.assert_array_equal(places.times, slow[channel].times)
                    np.testing.assert_array_equal(places.starts, slow[channel].starts)
                    np.testing.assert_array_equal(places.lengths, slow[channel].lengths)
                seen += 1
                channel = next(iter(indexes))
                assert indexed(data, indexes | {channel: indexes[channel][:-16]}) is None
                assert indexed(data, indexes | {channel: struct.pack("<QQ", 0, 1 << 60)}) is None
            pending, indexes = (record if isinstance(record, Chunk) else None), {}
    assert seen == 5


def test_velocities_of_bodies_are_those_of_a_known_motion() -> None:
    """A body on a circle that turns about a tilted axis: the central difference is exact to second order."""
    time = np.arange(400) * 0.001
    axis, rate = np.array((0.6, 0.0, 0.8)), 7.0
    position = np.stack((np.cos(3 * time), np.sin(3 * time), time**2), axis=-1)[:, None]
    half = rate * time / 2
    quat = np.concatenate((axis * np.sin(half)[:, None], np.cos(half)[:, None]), axis=1)[:, None]
    quat[::3] *= -1.0  # the same orientation
    linear, angular = body_velocities(time, position, quat)
    exact = np.stack((-3 * np.sin(3 * time), 3 * np.cos(3 * time), 2 * time), axis=-1)
    # The remainder of the central difference is |p'''| h^2 / 6 = 27e-6 / 6.
    np.testing.assert_allclose(linear[1:-1, 0], exact[1:-1], atol=4.6e-6)
    # At the ends it is |p''| h / 2 = 9e-3 / 2.
    np.testing.assert_allclose(linear[[0, -1], 0], exact[[0, -1]], atol=4.6e-3)
    np.testing.assert_allclose(angular[:, 0], np.tile(rate * axis, (400, 1)), atol=1e-9)
    still = body_velocities(time[:1], position[:1], quat[:1])
    assert not np.any(still)
    rest = body_velocities(time, np.ones((400, 1, 3)), np.tile((0.0, 0.0, 0.0, 1.0), (400, 1, 1)))
    assert not np.any(rest)


def test_a_run_killed_before_its_first_tick_has_no_states(tmp_path: Path, make_run: MakeRun) -> None:
    recorder = make_run(1).recorder(tmp_path / "run.mcap")
    recording = read_recording(recorder.partial_path)
    assert isinstance(recording.states, WorldState)
    assert recording.states.position.shape == (0, 4)
    assert recording.states.body_quat_xyzw.shape == (0, 2, 4)
    assert recording.lost == "the file is not finished"
    recorder.close_partial()


@pytest.mark.parametrize("gone", [{1}, {2}, {2, 3}])
def test_contacts_that_another_program_left_out_are_missed(
    make_run: MakeRun, rewrite_log: Any, tmp_path: Path, gone: set[int]
) -> None:
    """They hold until the next. `gone`: the numbers of those that are left out, as `mcap filter` keeps numbers."""
    log, thinned = make_run(450).write(tmp_path / "run.mcap"), tmp_path / "thinned.mcap"

    def kept(topic: str, message: Message) -> bytes | None:
        return None if topic == "/contacts" and message.sequence in gone else message.data

    assert len(read_recording(rewrite_log(log, thinned)).contacts) == 5
    rewrite_log(log, thinned, message=kept)
    with pytest.raises(Thinned, match="contacts"):
        read_recording(thinned)


@pytest.mark.parametrize("numbered", [lambda _: 0, lambda sequence: sequence - 1], ids=["nothing", "from 0"])
def test_contacts_that_another_program_numbers_otherwise_are_read(
    make_run: MakeRun, rewrite_log: Any, tmp_path: Path, numbered: Callable[[int], int]
) -> None:
    log, again = make_run(450).write(tmp_path / "run.mcap"), tmp_path / "again.mcap"

    def renumbered(_: str, message: Message) -> bytes:
        message.sequence = numbered(message.sequence)
        return message.data

    for chunk_size in (1 << 10, 1 << 20):  # one of contacts in the first, all of them
        rewrite_log(log, again, message=renumbered, chunk_size=chunk_size)
        assert_same(read_recording(again), read_recording(log))


def test_contacts_left_out_are_missed_where_numbers_begin_at_0(
    make_run: MakeRun, rewrite_log: Any, tmp_path: Path
) -> None:
    log, thinned = make_run(450).write(tmp_path / "run.mcap"), tmp_path / "thinned.mcap"

    def kept(topic: str, message: Message) -> bytes | None:
        message.sequence -= 1
        return None if topic == "/contacts" and message.sequence == 1 else message.data

    rewrite_log(log, thinned, message=kept)
    with pytest.raises(Thinned, match="contacts"):
        read_recording(thinned)
