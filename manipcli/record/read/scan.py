"""Sequential reader of the records of any MCAP file, finished, unfinished or damaged.

The file is untrusted: lengths, checksums, sizes and the number of damaged places are verified and bounded, and memory
holds one record at a time. A file without an end is read up to its last complete record. Damage is an error, or is
skipped on request: reading continues at the next valid record, found with the index at the end of the file if that is
intact, else by the start of a compressed chunk.
"""

from __future__ import annotations

import os
import stat
import struct
import zlib
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, TypeVar

from manipcli.core.activity import announce
from manipcli.record.cdr import CdrError
from manipcli.record.faults import REPAIRABLE, BadRecording
from manipcli.record.read.resync import Index, next_chunk, read_index
from manipcli.record.records import (
    CHUNK,
    DATA_END,
    FOOTER,
    FOOTER_RECORD,
    MAGIC,
    MAX_RECORD,
    MESSAGE,
    MESSAGE_INDEX,
    RECORD_HEAD,
)

MAX_NAMED = 4096
"""Most channels, schemas, attachments and metadata records in one file."""
MAX_DAMAGED = 256
"""Most damaged places in one file."""
_MAX_OPCODE = 0x7F
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Record:
    """A record of the data section and its offset in the file."""

    opcode: int
    offset: int
    body: bytes

    @property
    def end(self) -> int:
        """Offset of the next record."""
        return self.offset + RECORD_HEAD.size + len(self.body)


@dataclass(frozen=True, slots=True)
class Damage:
    """Bytes from `start` to `end` of the file that cannot be read; `what` describes them."""

    start: int
    end: int
    what: str


@dataclass(slots=True)
class Scan:
    """Iterates once over the records of the data section.

    Attributes:
        being_written: a file that ends after a complete record is not reported as incomplete.
        damaged: yield damage and continue after it, instead of raising.
        fault: damage of the current record, set by its reader.
        size: size of the file [byte].
        index: index at the end of the file, if `damaged`.
        lost: what is missing at the end, known after the iteration, or None.
    """

    path: Path
    being_written: bool = False
    damaged: bool = False
    fault: str = ""
    size: int = 0
    index: Index = field(default_factory=Index)
    lost: str | None = None
    _places: int = 0

    def __iter__(self) -> Iterator[Record | Damage]:
        """
        Raises:
            BadRecording: not an MCAP file, not readable, or damaged (with `damaged`: in too many places).
        """
        with readable(self.path), open_regular(self.path) as file:
            self.size = os.fstat(file.fileno()).st_size
            yield from self._records(file)

    def pieces(self) -> Iterator[tuple[Record, Mapping[int, bytes]]]:
        """The records of an undamaged file; chunks with their message indexes by channel."""
        chunk: Record | None = None
        indexes: dict[int, bytes] = {}
        for record in self:
            assert isinstance(record, Record), "damage is an error"
            if record.opcode == MESSAGE_INDEX:
                if chunk is not None:
                    channel, entries = guarded(self.path, record, message_index)
                    indexes[channel] = entries
                continue
            if chunk is not None:
                yield chunk, indexes
            chunk, indexes = (record if record.opcode == CHUNK else None), {}
            if chunk is None:
                yield record, {}
        if chunk is not None:
            # Some of its indexes can be missing.
            yield chunk, {}

    def _records(self, file: BinaryIO) -> Iterator[Record | Damage]:
        finished = is_finished(file, self.size)
        crc = zlib.crc32(_first_bytes(self.path, file))
        if finished and self.damaged:
            self.index = read_index(file, self.size)
        offset = len(MAGIC)
        while offset < self.size:
            record = self._record_at(file, offset)
            if record is not None and record.opcode == DATA_END:
                changed = record.body not in (crc.to_bytes(4, "little"), bytes(4))
                if changed and not (self.damaged and (self._places or not finished)):
                    yield self._damage(0, offset, "a part without its own checksum, such as a name or metadata")
                self._check_end(file, record.end, finished=finished)
                return
            self.fault = ""
            if record is not None:
                crc = zlib.crc32(record.body, zlib.crc32(RECORD_HEAD.pack(record.opcode, len(record.body)), crc))
                yield record
                if not self.fault:
                    offset = record.end
                    continue
            following = self._following(file, offset, record) if self.damaged else None
            if following is None and record is None and not finished:
                self.lost = f"the file is not finished, truncated in the record at byte {offset}"
                return
            following = self.size if following is None else following
            what = self.fault or f"{following - offset} bytes without a record"
            yield self._damage(offset, following, what)
            offset = following
        if finished:
            self.lost = "the end of its data is missing"
            if not self.damaged:
                raise BadRecording(self.path, "the end of its data is missing")
        elif not self.being_written:
            self.lost = "the file is not finished"

    def _damage(self, start: int, end: int, what: str) -> Damage:
        if not self.damaged:
            changed = "checksum mismatch: the file was changed after it was written"
            cause = f"the record at byte {start} is damaged" if start else changed
            raise BadRecording(self.path, cause, hint=REPAIRABLE)
        self._places += 1
        if self._places > MAX_DAMAGED:
            raise BadRecording(self.path, f"damaged in more than {MAX_DAMAGED} places")
        return Damage(start, end, what)

    def _record_at(self, file: BinaryIO, offset: int) -> Record | None:
        """The record at `offset`; None if it is invalid."""
        file.seek(offset)
        opcode, length = _head(file)
        if length > MAX_RECORD and not self.damaged:
            raise BadRecording(
                self.path, f"the record at byte {offset} declares {length} bytes, the limit is {MAX_RECORD}"
            )
        highest = DATA_END if self.damaged else _MAX_OPCODE
        if not 0 < opcode <= highest or length > MAX_RECORD or offset + RECORD_HEAD.size + length > self.size:
            return None
        body = file.read(length)
        return Record(opcode, offset, body) if len(body) == length else None

    def _check_end(self, file: BinaryIO, start: int, *, finished: bool) -> None:
        """Verify the summary, which shows whether the file was changed."""
        if not finished:
            self.lost = "the index at its end is missing"
            return
        if self.damaged:
            return
        if self.size - start > MAX_RECORD:
            raise BadRecording(self.path, f"summary larger than {MAX_RECORD} bytes")
        file.seek(start)
        rest = file.read(self.size - start)
        footer = len(rest) - len(MAGIC) - FOOTER_RECORD.size
        summary_start, crc = FOOTER_RECORD.unpack_from(rest, footer)[2:5:2] if footer >= 0 else (0, 0)
        if summary_start not in (0, start) or crc not in (0, zlib.crc32(rest[: footer + FOOTER_RECORD.size - 4])):
            # Nothing is read from the summary, and all that is read has checksums of its own.
            announce(f"{self.path.name}: the summary does not fit its checksum; it is not used")

    def _following(self, file: BinaryIO, offset: int, record: Record | None) -> int | None:
        """Offset at which to continue after damage at `offset`; None if there is none."""
        if record is not None:
            behind = self._record_at(file, record.end)
            if record.end == self.size or (behind is not None and behind.opcode != MESSAGE):
                return record.end
        known = self.index.offsets
        if known:
            k = bisect_right(known, offset)
            return known[k] if k < len(known) else None
        return next_chunk(file, offset + 1, self.size)


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Convert OS errors to `BadRecording` with the path."""
    try:
        yield
    except OSError as error:
        raise BadRecording(path, f"cannot read the file: {error.strerror or error}") from error


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file for reading; opening a pipe would block.

    Raises:
        BadRecording: not a regular file.
        OSError: the file cannot be opened.
    """
    file = os.fdopen(os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK), "rb")
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise BadRecording(path, "not a regular file")
    return file


def is_finished(file: BinaryIO, size: int) -> bool:
    """Whether the file ends with a footer and the magic bytes."""
    tail = FOOTER_RECORD.size + len(MAGIC)
    if size < tail:
        return False
    file.seek(size - tail)
    end = file.read(tail)
    return end.endswith(MAGIC) and end.startswith(RECORD_HEAD.pack(FOOTER, 20))


def chunk_at(path: Path, file: BinaryIO, offset: int) -> tuple[Record, dict[int, bytes]]:
    """Read a chunk and its message indexes from a file that was scanned before.

    Raises:
        BadRecording: the file changed.
    """
    indexes: dict[int, bytes] = {}
    chunk: Record | None = None
    file.seek(offset)
    while True:
        opcode, length = _head(file)
        if chunk is not None and opcode != MESSAGE_INDEX:
            return chunk, indexes
        body = file.read(min(length, MAX_RECORD))
        record = Record(opcode, offset, body)
        if chunk is None:
            if opcode != CHUNK or len(body) < length:
                raise BadRecording(path, "the file changed while it was read")
            chunk = record
        else:
            try:
                channel, entries = message_index(record)
            except (CdrError, struct.error):  # damaged or truncated: use no index unless all are valid
                return chunk, {}
            indexes[channel] = entries
        offset = record.end


def guarded(path: Path, record: Record, read: Callable[[Record], R]) -> R:
    """`read(record)`; damage raises `BadRecording` with the offset."""
    from mcap.exceptions import McapError

    try:
        return read(record)
    except (McapError, CdrError, struct.error, UnicodeDecodeError) as error:
        cause = f": {error}" if isinstance(error, CdrError) else ""
        raise BadRecording(path, f"the record at byte {record.offset} is damaged{cause}", hint=REPAIRABLE) from error


def message_index(record: Record) -> tuple[int, bytes]:
    """Channel, and the encoded pairs of log time and offset."""
    channel, length = struct.unpack_from("<HI", record.body)
    if length != len(record.body) - 6 or length % 16:
        raise CdrError("a message index has a wrong length")
    return channel, record.body[6:]


def _first_bytes(path: Path, file: BinaryIO) -> bytes:
    file.seek(0)
    start = file.read(len(MAGIC))
    if start != MAGIC:
        cause = "the file is empty" if not start else "not an MCAP file (wrong first bytes)"
        raise BadRecording(path, cause, hint="use an .mcap file, such as those of `manipcli run`")
    return start


def _head(file: BinaryIO) -> tuple[int, int]:
    """Opcode and length of the next record; (0, 0) if truncated."""
    head = file.read(RECORD_HEAD.size)
    opcode, length = RECORD_HEAD.unpack(head) if len(head) == RECORD_HEAD.size else (0, 0)
    return opcode, length
