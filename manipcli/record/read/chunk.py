"""Decompression and verification of a chunk, and the positions of its messages by channel."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.decode import Int
from manipcli.record.faults import REPAIRABLE, BadRecording
from manipcli.record.read.scan import Record
from manipcli.record.records import CHUNK_HEAD, MESSAGE, MESSAGE_HEAD, PAYLOAD, RECORD_HEAD

MAX_CHUNK = 1 << 26
"""Largest decompressed chunk [byte]; the compression ratio is not limited, because uniform images compress well."""
_MAX_OTHERS = 8192
"""Most schemas and channels in a chunk."""


def open_chunk(path: Path, record: Record) -> bytes:
    """The decompressed message records of a chunk, bounded in size and verified by its checksum; checksum 0 means
    none."""
    try:
        start_ns, end_ns, size, crc = CHUNK_HEAD.unpack_from(record.body)
        (name_length,) = struct.unpack_from("<I", record.body, CHUNK_HEAD.size)
        name_end = CHUNK_HEAD.size + 4 + name_length
        compression = record.body[CHUNK_HEAD.size + 4 : name_end].decode("ascii", errors="replace")
        (length,) = struct.unpack_from("<Q", record.body, name_end)
    except struct.error as error:
        raise BadRecording(path, f"the chunk at byte {record.offset} is damaged", hint=REPAIRABLE) from error
    where = f"the chunk at byte {record.offset} (t = {start_ns / 1e9:.3f} to {end_ns / 1e9:.3f} s)"
    packed = memoryview(record.body)[name_end + 8 :]
    if len(packed) != length:
        raise BadRecording(path, f"{where} is damaged", hint=REPAIRABLE)
    if size > MAX_CHUNK:
        raise BadRecording(
            path,
            f"{where} declares {size} bytes, the limit is {MAX_CHUNK}",
            hint="write smaller chunks with the recording program",
        )
    data = _decompress(compression, packed, size)
    if data is None or len(data) != size or crc not in (0, zlib.crc32(data)):
        raise BadRecording(path, f"{where} is damaged: its checksum does not match", hint=REPAIRABLE)
    return data


def _decompress(compression: str, packed: memoryview, size: int) -> bytes | None:
    """At most `size` decompressed bytes; None for invalid data."""
    if compression == "":
        return bytes(packed)
    if compression == "zstd":
        import zstandard

        try:
            # Limit the output, because a frame can declare any size.
            if zstandard.frame_content_size(packed) not in (size, -1):
                return None
            return zstandard.ZstdDecompressor(max_window_size=1 << 27).decompress(packed, max_output_size=size)
        except zstandard.ZstdError:
            return None
    if compression == "lz4":
        # lz4 has no type information.
        import lz4.frame  # type: ignore[import-untyped]

        try:
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size))
        except RuntimeError:
            return None
    return None


@dataclass(frozen=True, slots=True)
class Places:
    """The messages of one channel in a chunk, in the order of the file: log times [ns], payload offsets and lengths."""

    times: Int
    starts: Int
    lengths: Int

    def at(self, which: Int) -> Places:
        """The selected messages."""
        return Places(self.times[which], self.starts[which], self.lengths[which])


def indexed(data: bytes, indexes: Mapping[int, bytes], *, whole: bool = True) -> dict[int, Places] | None:
    """Messages by channel from a chunk's message indexes (channel -> pairs of log time and offset).

    None if an index is wrong or, with `whole`, if the indexes do not cover every byte of the chunk.
    """
    found: dict[int, Places] = {}
    for channel, raw in indexes.items():
        places = _located(data, channel, raw)
        if places is None:
            return None
        if len(places.times):
            found[channel] = places
    if not found:
        return None
    if not whole:
        return found
    begins = np.sort(np.concatenate([places.starts for places in found.values()])) - PAYLOAD
    stops = np.sort(np.concatenate([places.starts + places.lengths for places in found.values()]))
    covered = begins[0] == 0 and stops[-1] == len(data) and np.array_equal(begins[1:], stops[:-1])
    return found if covered else None


def _located(data: bytes, channel: int, raw: bytes) -> Places | None:
    """The messages of one channel from its message index; None if an entry is wrong."""
    size = len(data)
    entries = np.frombuffer(raw, dtype="<u8").reshape(-1, 2)
    if len(entries) and (size < PAYLOAD or entries[:, 1].max() > size - PAYLOAD):
        return None
    at = entries[:, 1].astype(np.int64)
    lengths = every(data, "<u8")[at + 1]
    fits = (
        (np.frombuffer(data, dtype=np.uint8)[at] == MESSAGE)
        & (lengths >= PAYLOAD - 9)
        & (lengths <= size)
        & (every(data, "<u2")[at + 9] == channel)
        & (every(data, "<u8")[at + 15] == entries[:, 0])
    )
    if not fits.all():
        return None
    return Places(entries[:, 0].astype(np.int64), at + PAYLOAD, lengths.astype(np.int64) - (PAYLOAD - 9))


def chunk_places(data: bytes, indexes: Mapping[int, bytes]) -> dict[int, Places]:
    """All messages by channel: from the indexes if they cover every byte, else by walking over the records, for
    truncated files and files of other tools.

    Raises:
        CdrError: from the walk.
    """
    found = indexed(data, indexes)
    return walked(data)[0] if found is None else found


def walked(data: bytes) -> tuple[dict[int, Places], list[tuple[int, bytes]]]:
    """Messages by channel, found by walking over the records; and the records of other kinds (opcode, body).

    Raises:
        CdrError: a record exceeds the chunk, or too many records are not messages.
    """
    rows: dict[int, list[tuple[int, int, int]]] = {}
    others: list[tuple[int, bytes]] = []
    offset = 0
    while offset < len(data):
        if offset + RECORD_HEAD.size > len(data):
            raise CdrError("ends too early")
        opcode, length = RECORD_HEAD.unpack_from(data, offset)
        end = offset + 9 + length
        if end > len(data) or (opcode == MESSAGE and length < PAYLOAD - 9):
            raise CdrError("ends too early")
        if opcode == MESSAGE:
            _, _, channel, _, time, _ = MESSAGE_HEAD.unpack_from(data, offset)
            rows.setdefault(channel, []).append((min(time, 2**63 - 1), offset + PAYLOAD, length - (PAYLOAD - 9)))
        elif opcode == 0 or len(others) == _MAX_OTHERS:
            raise CdrError("has too many records that are not messages")
        else:
            others.append((opcode, data[offset + 9 : end]))
        offset = end
    found = {}
    for channel, entries in rows.items():
        table = np.array(entries, dtype=np.int64)
        found[channel] = Places(table[:, 0], table[:, 1], table[:, 2])
    return found, others


def every(data: bytes, code: str) -> npt.NDArray[np.uint64]:
    """The number that begins at each byte of `data`, as a view."""
    kind = np.dtype(code)
    return np.ndarray((max(len(data) - kind.itemsize + 1, 0),), dtype=kind, buffer=data, strides=(1,))


def singly(data: bytes, places: Places) -> Iterator[tuple[int, CdrReader]]:
    """(log time [ns], reader) of each message."""
    view = memoryview(data)
    for ns, start, length in zip(places.times.tolist(), places.starts.tolist(), places.lengths.tolist(), strict=True):
        yield ns, CdrReader(view[start : start + length])


def sequences(data: bytes, places: Places) -> Int:
    """The sequence number of each message."""
    return every(data, "<u4")[places.starts - PAYLOAD + 11].astype(np.int64)
