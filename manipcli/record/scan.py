"""The records of an MCAP file one after the other, trusting nothing: lengths, checksums and the end are verified.

A file whose writer died has no end; it is read up to its last whole record. A file that has its end is read strictly:
whatever does not fit together there was changed after it was written.
"""

from __future__ import annotations

import os
import stat
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, TypeVar

from manipcli.record.cdr import CdrError
from manipcli.record.container import MAGIC
from manipcli.record.faults import REPAIRABLE, BadRecording

MAX_NAMED = 4096
"""Channels, schemas, attachments and metadata records in one file."""

MAX_RECORD = 1 << 28
MAX_CHUNK = 1 << 26
"""[byte] of a chunk, unpacked; below, it may compress as well as it likes: images and maps of one value do."""

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, ATTACHMENT, METADATA, DATA_END = (
    0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x09, 0x0C, 0x0F,
)  # fmt: skip
_NO_CRC = bytes(4)
"""How other writers say that they made no checksum; ours always make one."""
_FIRST_OPCODE, _LAST_OPCODE = 0x01, 0x7F
RECORD_HEAD = struct.Struct("<BQ")
"""Opcode and length of what follows."""
_CHUNK_HEAD = struct.Struct("<QQQI")
FOOTER_RECORD = struct.Struct("<BQQQI")

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Record:
    """One record of the data section and where it begins in the file."""

    opcode: int
    offset: int
    body: bytes

    @property
    def end(self) -> int:
        """Where the next record begins."""
        return self.offset + RECORD_HEAD.size + len(self.body)


@dataclass(frozen=True, slots=True)
class ChunkPlace:
    """Where a chunk and the message indexes behind it stand in the file."""

    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Piece:
    """A record and, of a chunk, the message indexes behind it by channel; `end`: where the next one begins."""

    record: Record
    end: int
    indexes: Mapping[int, bytes]


class Scan:
    """Iterate once over the records of the data section; afterwards `lost` says what is missing at the end.

    `being_written`: a file that stops behind a whole record is complete as far as it goes.
    """

    def __init__(self, path: Path, *, being_written: bool = False) -> None:
        self.path = path
        self.lost: str | None = None
        self._being_written = being_written

    def __iter__(self) -> Iterator[Record]:
        with readable(self.path), open_regular(self.path) as file:
            yield from self._records(file, os.fstat(file.fileno()).st_size)

    def pieces(self) -> Iterator[Piece]:
        """The same records, the indexes of messages with the chunk that they are of."""
        chunk: Record | None = None
        indexes: dict[int, bytes] = {}
        end = 0
        for record in self:
            if record.opcode == MESSAGE_INDEX:
                if chunk is not None:
                    channel, entries = guarded(self.path, record, message_index)
                    indexes[channel], end = entries, record.end
                continue
            if chunk is not None:
                yield Piece(chunk, end, indexes)
            chunk, indexes, end = (record if record.opcode == CHUNK else None), {}, record.end
            if chunk is None:
                yield Piece(record, end, {})
        if chunk is not None:
            # Some of its indexes may have been cut off.
            yield Piece(chunk, chunk.end, {})

    def _records(self, file: BinaryIO, size: int) -> Iterator[Record]:
        finished = is_finished(file, size)
        crc = zlib.crc32(first_bytes(self.path, file))
        offset = len(MAGIC)
        while offset < size:
            head, opcode, length = read_head(file)
            end = offset + RECORD_HEAD.size + length
            if len(head) == RECORD_HEAD.size and length > MAX_RECORD:
                raise BadRecording(self.path, f"the record at byte {offset} is said to be {length} bytes long")
            if not _FIRST_OPCODE <= opcode <= _LAST_OPCODE or end > size:
                self._cut(offset, finished=finished)
                return
            body = file.read(length)
            if opcode == DATA_END:
                if body not in (crc.to_bytes(4, "little"), _NO_CRC):
                    raise BadRecording(
                        self.path, "its checksum does not match: it was changed after it was written", hint=REPAIRABLE
                    )
                self._check_end(file, end, size, finished=finished)
                return
            crc = zlib.crc32(body, zlib.crc32(head, crc))
            yield Record(opcode, offset, body)
            offset = end
        if finished:
            raise BadRecording(self.path, "has an end, but no end of its data")
        if not self._being_written:
            self.lost = "it was not finished"

    def _cut(self, offset: int, *, finished: bool) -> None:
        if finished:
            raise BadRecording(self.path, f"the record at byte {offset} is damaged", hint=REPAIRABLE)
        self.lost = f"it was not finished, and is cut within the record at byte {offset}"

    def _check_end(self, file: BinaryIO, start: int, size: int, *, finished: bool) -> None:
        """The summary is not needed to read the data, but it tells whether somebody was at the file."""
        if not finished:
            self.lost = "the index at its end is missing, though all messages are there"
            return
        if size - start > MAX_RECORD:
            raise BadRecording(self.path, "its summary is too large")
        rest = file.read(size - start)
        footer = len(rest) - len(MAGIC) - FOOTER_RECORD.size
        summary_start, crc = FOOTER_RECORD.unpack_from(rest, footer)[2:5:2] if footer >= 0 else (0, 0)
        if summary_start not in (0, start) or crc not in (0, zlib.crc32(rest[: footer + FOOTER_RECORD.size - 4])):
            raise BadRecording(self.path, "the checksum of its summary does not match: it was changed", hint=REPAIRABLE)


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """What the system refuses becomes an error that names the file."""
    try:
        yield
    except OSError as error:
        raise BadRecording(path, f"cannot be read: {error.strerror or error}") from error


def first_bytes(path: Path, file: BinaryIO) -> bytes:
    """Those that every MCAP file begins with; what follows is read next.

    Raises:
        BadRecording: they are others.
    """
    file.seek(0)
    start = file.read(len(MAGIC))
    if start != MAGIC:
        cause = "is empty" if not start else "is no MCAP file (its first bytes are others)"
        raise BadRecording(path, cause, hint="a recording is an .mcap file that manipcli run has written")
    return start


def read_head(file: BinaryIO) -> tuple[bytes, int, int]:
    """The head of a record, its opcode and length; (0, 0) where it is cut."""
    head = file.read(RECORD_HEAD.size)
    opcode, length = RECORD_HEAD.unpack(head) if len(head) == RECORD_HEAD.size else (0, 0)
    return head, opcode, length


def open_regular(path: Path) -> BinaryIO:
    """A file to read; opening a pipe would wait for whoever writes into it.

    Raises:
        BadRecording: it is none.
        OSError: it cannot be opened.
    """
    file = os.fdopen(os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK), "rb")
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise BadRecording(path, "is not a regular file")
    return file


def is_finished(file: BinaryIO, size: int) -> bool:
    """Whether the file ends with a footer and the magic bytes."""
    tail = FOOTER_RECORD.size + len(MAGIC)
    if size < tail:
        return False
    file.seek(size - tail)
    end = file.read(tail)
    return end.endswith(MAGIC) and end.startswith(RECORD_HEAD.pack(FOOTER, 20))


def records_at(path: Path, file: BinaryIO, place: ChunkPlace) -> Iterator[Record]:
    """A chunk and its indexes once more, from a file that was scanned before.

    Raises:
        BadRecording: they are not there any more.
    """
    file.seek(place.start)
    offset = place.start
    while offset < place.end:
        head, opcode, length = read_head(file)
        body = file.read(length) if length <= place.end - offset - RECORD_HEAD.size else b""
        if len(head) < RECORD_HEAD.size or len(body) < length or (opcode == CHUNK) != (offset == place.start):
            raise BadRecording(path, "changed while it was read")
        record = Record(opcode, offset, body)
        yield record
        offset = record.end


def guarded(path: Path, record: Record, read: Callable[[Record], R]) -> R:
    """What `read` makes of a record; what it stumbles over becomes an error that says where."""
    from mcap.exceptions import McapError

    try:
        return read(record)
    except (McapError, CdrError, struct.error, UnicodeDecodeError) as error:
        cause = f": {error}" if isinstance(error, CdrError) else ""
        raise BadRecording(path, f"the record at byte {record.offset} is damaged{cause}", hint=REPAIRABLE) from error


def message_index(record: Record) -> tuple[int, bytes]:
    """Channel, and the pairs of log time and offset as they stand."""
    channel, length = struct.unpack_from("<HI", record.body)
    if length != len(record.body) - 6 or length % 16:
        raise CdrError("a message index has another length than it says")
    return channel, record.body[6:]


def open_chunk(path: Path, record: Record) -> bytes:
    """The decompressed message records of a chunk, bounded in size and verified by its checksum; 0 says that its writer
    made none."""
    try:
        start_ns, end_ns, size, crc = _CHUNK_HEAD.unpack_from(record.body)
        (name_length,) = struct.unpack_from("<I", record.body, _CHUNK_HEAD.size)
        name_end = _CHUNK_HEAD.size + 4 + name_length
        compression = record.body[_CHUNK_HEAD.size + 4 : name_end].decode("ascii", errors="replace")
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
            f"{where} declares {size} bytes, more than the {MAX_CHUNK} that are read of one",
            hint="have the program that wrote it write smaller chunks",
        )
    data = _decompress(compression, packed, size)
    if data is None or len(data) != size or crc not in (0, zlib.crc32(data)):
        raise BadRecording(path, f"{where} is damaged: its checksum does not match", hint=REPAIRABLE)
    return data


def _decompress(compression: str, packed: memoryview, size: int) -> bytes | None:
    """At most `size` bytes; None when the data is not what the compression makes."""
    if compression == "":
        return bytes(packed)
    if compression == "zstd":
        import zstandard

        try:
            # A frame may declare its own size, which the decompressor would then believe.
            if zstandard.frame_content_size(packed) not in (size, -1):
                return None
            return zstandard.ZstdDecompressor(max_window_size=1 << 27).decompress(packed, max_output_size=size)
        except zstandard.ZstdError:
            return None
    if compression == "lz4":
        # It ships no types.
        import lz4.frame  # type: ignore[import-untyped]

        try:
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size))
        except RuntimeError:
            return None
    return None
