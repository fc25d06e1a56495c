"""Whatever happened to a log, repairing gives a clean MCAP file of all that is sound in it, and an honest account."""

from __future__ import annotations

import contextlib
import os
import struct
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.writer import CompressionType, IndexType, Writer

from manipcli.record.faults import BadRecording, CopyFailed, RecordingRefused
from manipcli.record.foreign.repair import default_output, repair
from manipcli.record.foreign.snapshot import snapshot
from manipcli.record.foreign.topics import open_topics
from manipcli.record.read.reading import open_recording, read_recording
from manipcli.record.write import recorder as recorder_module

MakeRun = Callable[[int], Any]
MAGIC = b"\x89MCAP0\r\n"
Messages = list[tuple[str, int, bytes]]


@pytest.fixture
def small(tmp_path: Path, make_run: MakeRun, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A log of 40 ticks in five chunks."""
    monkeypatch.setattr(recorder_module, "BLOCK_SECONDS", 0.01)
    return make_run(40).write(tmp_path / "small.mcap")


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(opcode, begin, end) of each record at the top of an MCAP file."""
    offset = len(MAGIC)
    while offset < len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, offset)
        yield opcode, offset, offset + 9 + length
        offset += 9 + length


def read_by_mcap(path: Path) -> tuple[Messages, list[str]]:
    """All messages and the names of all attachments, by the mcap library with every checksum on."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        messages = [(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages(log_time_order=False)]
        assert summary.statistics.message_count == len(messages)
        assert summary.statistics.metadata_count == len(list(reader.iter_metadata()))
        return messages, [attachment.name for attachment in reader.iter_attachments()]


def repaired(data: bytes, folder: Path) -> tuple[Any, Messages, list[str]]:
    """A file of these bytes, repaired and read."""
    (folder / "bad.mcap").write_bytes(data)
    done = repair(folder / "bad.mcap", folder / "good.mcap", overwrite=True)
    messages, attachments = read_by_mcap(folder / "good.mcap")
    assert (done.messages, list(done.attachments)) == (len(messages), attachments)
    assert not (folder / "good.mcap.repairing").exists()
    return done, messages, attachments


def test_a_sound_log_loses_nothing(small: Path, tmp_path: Path) -> None:
    done, messages, attachments = repaired(small.read_bytes(), tmp_path)
    assert done.losses == ()
    assert done.messages_lost == 0
    assert (messages, attachments) == read_by_mcap(small)
    assert open_recording(tmp_path / "good.mcap").lost is None
    np.testing.assert_array_equal(read_recording(tmp_path / "good.mcap").states.time, read_recording(small).states.time)


@pytest.mark.slow
def test_cut_anywhere_the_chunks_before_the_cut_are_kept(small: Path, tmp_path: Path) -> None:
    data = small.read_bytes()
    whole, names = read_by_mcap(small)
    ends = [(opcode, end) for opcode, _, end in records(data)]
    data_end = next(end for opcode, end in ends if opcode == 0x0F)
    counts = [len(messages_of(data, begin)) for opcode, begin, _ in records(data) if opcode == 6]
    cuts = {end + k for _, end in ends for k in (0, 1)} | set(range(0, len(data), 3989))
    tried = 0
    for cut in sorted(cut for cut in cuts if cut < len(data)):
        before = [opcode for opcode, end in ends if end <= cut]
        if 4 not in before:
            with pytest.raises(BadRecording, match=r"the file is empty|not an MCAP file|nothing to keep"):
                repaired(data[:cut], tmp_path)
            continue
        done, messages, attachments = repaired(data[:cut], tmp_path)
        assert messages == whole[: sum(counts[: before.count(6)])]
        assert attachments == names[: before.count(9)]
        assert done.messages_lost is None
        assert len(done.losses) == 1
        unfinished = "the index at its end is missing" if cut >= data_end else "the file is not finished"
        assert unfinished in str(done.losses[0])
        tried += 1
        if 0x0C in before:  # it says that it is a log of ours
            lost = open_recording(tmp_path / "good.mcap").lost
            assert lost is not None
            assert lost.startswith("repaired with losses")
    assert tried > 60


def messages_of(data: bytes, begin: int) -> list[int]:
    """Log times in the chunk that begins there."""
    from io import BytesIO

    from mcap.data_stream import ReadDataStream
    from mcap.stream_reader import breakup_chunk

    chunk = Chunk.read(ReadDataStream(BytesIO(data[begin + 9 :])))
    return [record.log_time for record in breakup_chunk(chunk)]


@pytest.mark.slow
def test_a_flipped_bit_costs_at_most_the_part_it_is_in(small: Path, tmp_path: Path) -> None:
    data = small.read_bytes()
    whole, names = read_by_mcap(small)
    rng = np.random.default_rng(3)
    end = next(begin for opcode, begin, _ in records(data) if opcode == 0x0F)
    for at in [
        *rng.integers(len(MAGIC), end, size=60).tolist(),
        *(begin + 3 for _, begin, e in records(data) if e < end),
    ]:
        spoilt = bytearray(data)
        spoilt[at] ^= 1 << int(rng.integers(8))
        opcode = next(opcode for opcode, begin, e in records(data) if begin <= at < e)
        done, messages, attachments = repaired(bytes(spoilt), tmp_path)
        assert done.losses, f"the bit at {at} was not noticed"
        if opcode in (3, 4):  # names of types and topics have no checksum of their own
            continue
        assert len(names) - len(attachments) <= (1 if opcode == 9 else 0)
        kept = set(messages)
        missing = [k for k, message in enumerate(whole) if message not in kept]
        assert kept <= set(whole)
        if opcode != 6:
            assert missing == []
        elif missing:  # the times in the head of a chunk have no checksum, and cost nothing
            assert missing == list(range(missing[0], missing[-1] + 1)), "one stretch"
            assert len(missing) == done.messages_lost <= len(whole) // 3


def test_holes_are_told_by_their_times(small: Path, tmp_path: Path) -> None:
    data = bytearray(small.read_bytes())
    chunks = [(begin, end) for opcode, begin, end in records(bytes(data)) if opcode == 6]
    begin, _ = chunks[2]  # 10 to 19 ms; the first holds what is written once
    _, end = chunks[3]
    data[begin:end] = bytes(end - begin)
    done, messages, _ = repaired(bytes(data), tmp_path)
    (loss,) = done.losses
    assert (loss.after, loss.before) == (0.009, 0.03)
    assert done.messages_lost == len(read_by_mcap(small)[0]) - len(messages) > 0
    # Without the index at the end, the next chunk is found by how one begins.
    cut = bytes(data[: chunks[-1][1]])
    again, same, _ = repaired(cut, tmp_path)
    assert same == messages[: len(same)]
    assert [(one.after, one.before) for one in again.losses] == [(0.009, 0.03), (0.039, None)]
    assert again.messages_lost is None


def test_a_log_with_a_hole_is_never_judged_whole(small: Path, tmp_path: Path) -> None:
    data = bytearray(small.read_bytes())
    end = [end for opcode, _, end in records(bytes(data)) if opcode == 6][2]
    data[end - 5] ^= 1
    repaired(bytes(data), tmp_path)
    assert "between t = 0.009 s and 0.020 s" in (open_recording(tmp_path / "good.mcap").lost or "")


@pytest.mark.parametrize("compression", list(CompressionType))
@pytest.mark.parametrize("chunking", [True, False])
def test_logs_of_other_writers(small: Path, tmp_path: Path, compression: CompressionType, chunking: bool) -> None:
    """Channels inside chunks, messages outside of them, other compressions; cut and whole."""
    whole, _ = read_by_mcap(small)
    foreign = tmp_path / "foreign.mcap"
    with foreign.open("wb") as target:
        writer = Writer(
            target, chunk_size=3000, compression=compression, use_chunking=chunking, index_types=IndexType.ALL
        )
        writer.start(profile="ros2", library="somebody")
        ids: dict[str, int] = {}
        for topic, time, data in whole:
            if topic not in ids:
                ids[topic] = writer.register_channel(topic, "cdr", writer.register_schema(topic, "ros2msg", b""))
            writer.add_message(ids[topic], time, data, time, 1)
        writer.finish()
    data = foreign.read_bytes()
    done, messages, _ = repaired(data, tmp_path)
    assert messages == whole
    assert done.losses == ()
    assert open_topics(tmp_path / "good.mcap").library == "somebody"
    done, messages, _ = repaired(data[: len(data) // 2], tmp_path)
    assert messages == whole[: len(messages)]
    assert len(messages) > len(whole) // 8
    assert done.losses


def test_what_a_declaration_is_missing_for_is_left_out(small: Path, tmp_path: Path) -> None:
    """The channel of /tf is overwritten: with the index at the end it is known all the same, without it is lost."""
    data = bytearray(small.read_bytes())
    at = data.index(b"\x03\x00\x00\x00/tf\x03") - 4
    data[at + 4 : at + 8] = b"\xff\xff\xff\xff"  # the length of the topic's name
    whole, _ = read_by_mcap(small)
    _, messages, _ = repaired(bytes(data), tmp_path)
    assert sorted(messages) == sorted(whole)
    cut = max(end for opcode, _, end in records(small.read_bytes()) if opcode == 7)
    done, messages, _ = repaired(bytes(data[:cut]), tmp_path)
    assert messages == [message for message in whole if message[0] != "/tf"]
    told = "; ".join(map(str, done.losses))
    assert "a channel" in told
    assert "10 messages of channels without a declaration" in told


class TestHostile:
    def test_many_damaged_places_are_given_up(self, tmp_path: Path) -> None:
        # Each of these heads says it is a chunk, and its body is none.
        body = bytes(28) + b"\x04\x00\x00\x00zstd" + bytes(8)
        junk = (b"\x06" + struct.pack("<Q", len(body)) + body) * 2000
        (tmp_path / "bad.mcap").write_bytes(MAGIC + junk)
        with pytest.raises(BadRecording, match="damaged in more than 256 places"):
            repair(tmp_path / "bad.mcap", tmp_path / "good.mcap")
        assert [path.name for path in tmp_path.iterdir()] == ["bad.mcap"]

    @pytest.mark.parametrize("length", [1 << 62, 1 << 31, 1 << 63])
    def test_record_length(self, small: Path, tmp_path: Path, length: int) -> None:
        data = small.read_bytes()
        cut = max(end for opcode, _, end in records(data) if opcode == 7)
        done, _, _ = repaired(data[:cut] + b"\x06" + struct.pack("<Q", length) + b"x" * 100, tmp_path)
        assert done.end == 0.039

    def test_a_bomb_is_left_out(self, small: Path, tmp_path: Path) -> None:
        import zstandard

        data = small.read_bytes()
        cut = max(end for opcode, _, end in records(data) if opcode == 7)
        packed = zstandard.ZstdCompressor().compress(bytes(1 << 27))
        body = (
            struct.pack("<QQQI", 0, 1, 1 << 27, 0) + b"\x04\x00\x00\x00zstd" + struct.pack("<Q", len(packed)) + packed
        )
        bomb = b"\x06" + struct.pack("<Q", len(body)) + body
        tracemalloc.start()
        done, _, _ = repaired(data[:cut] + bomb + data[cut:], tmp_path)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 1 << 25
        assert "declares 134217728 bytes" in str(done.losses[0])
        assert done.end == 0.039

    @pytest.mark.parametrize("data", [b"", b"hello", MAGIC, MAGIC + bytes(1000), MAGIC + b"\x01" * 500])
    def test_nothing_to_keep(self, tmp_path: Path, data: bytes) -> None:
        (tmp_path / "bad.mcap").write_bytes(data)
        with pytest.raises(BadRecording):
            repair(tmp_path / "bad.mcap", tmp_path / "good.mcap")
        assert [path.name for path in tmp_path.iterdir()] == ["bad.mcap"]


def test_nothing_is_overwritten_unasked(small: Path, tmp_path: Path) -> None:
    before = small.read_bytes()
    for force in (False, True):
        with pytest.raises(RecordingRefused, match="output and input are the same file"):
            repair(small, small, overwrite=force)
    link = tmp_path / "link.mcap"
    link.hardlink_to(small)
    with pytest.raises(RecordingRefused, match="output and input are the same file"):
        repair(small, link, overwrite=True)
    other = tmp_path / "other.mcap"
    other.write_text("mine")
    with pytest.raises(RecordingRefused, match="the file exists"):
        repair(small, other)
    assert other.read_text() == "mine"
    repair(small, other, overwrite=True)
    assert read_by_mcap(other) == read_by_mcap(small)
    assert small.read_bytes() == before


def test_a_partial_log_may_become_the_log_it_was_to_be(small: Path, tmp_path: Path) -> None:
    data = small.read_bytes()
    partial = tmp_path / "run.mcap.partial"
    partial.write_bytes(data[: len(data) // 2])
    assert default_output(partial) == tmp_path / "run.repaired.mcap"
    assert default_output(small) == tmp_path / "small.repaired.mcap"
    repair(partial, tmp_path / "run.mcap")
    assert partial.read_bytes() == data[: len(data) // 2]
    assert read_by_mcap(tmp_path / "run.mcap")[0]


def test_a_log_that_is_being_written_is_left_alone(make_run: MakeRun, tmp_path: Path) -> None:
    run = make_run(20)
    recorder = run.recorder(tmp_path / "run.mcap")
    with pytest.raises(BadRecording, match="a run is still writing this file"):
        repair(recorder.partial_path, tmp_path / "good.mcap")
    recorder.close_partial()
    repair(recorder.partial_path, tmp_path / "good.mcap")


def test_a_full_disk_leaves_no_half_file(small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.write
    for fail_at in range(1, 40):
        count = 0

        def write(fd: int, data: bytes) -> int:
            nonlocal count
            count += 1
            if count == fail_at:  # noqa: B023
                raise OSError(28, "No space left on device")
            return real(fd, data)

        with monkeypatch.context() as patch:
            patch.setattr(os, "write", write)
            try:
                repair(small, tmp_path / "good.mcap")
            except CopyFailed as failure:
                told = f"cannot write {tmp_path}/good.mcap: No space left on device; the incomplete copy is removed"
                assert told in str(failure)
                assert [path.name for path in tmp_path.iterdir()] == ["small.mcap"]
            else:
                break
    assert fail_at > 10


@pytest.mark.slow
def test_whatever_was_done_to_a_log_it_is_refused_or_repaired(small: Path, tmp_path: Path) -> None:
    """Bytes changed, left out, doubled, lengths spoilt: no other error, and what comes out is clean."""
    data = small.read_bytes()
    rng = np.random.default_rng(11)
    done = 0
    for _ in range(120):
        spoilt = bytearray(data)
        for _ in range(int(rng.choice([1, 2, 5, 20]))):
            at, size = int(rng.integers(len(spoilt))), int(rng.choice([1, 9, 100, 3000]))
            match int(rng.integers(5)):
                case 0:
                    spoilt[at] = int(rng.integers(256))
                case 1:
                    spoilt[at : at + 8] = struct.pack("<Q", int(rng.choice([0, 1, 2**31, 2**62])))
                case 2:
                    del spoilt[at : at + size]
                case 3:
                    spoilt[at:at] = data[at : at + size]
                case 4:
                    spoilt[at:at] = rng.bytes(size)
        (tmp_path / "bad.mcap").write_bytes(spoilt)
        try:
            open_topics(tmp_path / "bad.mcap", damaged=True)
            repaired(bytes(spoilt), tmp_path)
            done += 1
        except BadRecording:
            pass
        with contextlib.suppress(BadRecording):
            snapshot(open_topics(tmp_path / "bad.mcap", damaged=True), 1.0)
    assert done > 35


def test_the_name_of_a_run_that_was_killed_leads_to_what_it_left(small: Path) -> None:
    small.rename(small.with_name("killed.mcap.partial"))
    with pytest.raises(BadRecording) as caught:
        read_recording(small.with_name("killed.mcap"))
    assert "an unfinished run left killed.mcap.partial" in str(caught.value.findings[0].hint)
    with pytest.raises(BadRecording) as caught:
        read_recording(small.with_name("never.mcap"))
    assert caught.value.findings[0].hint is None
