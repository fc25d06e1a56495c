"""What can still be read of an MCAP file that was cut, damaged or never finished, whoever wrote it.

Every part is verified on its own: a chunk and an attachment by their checksums, everything else by whether it can be
read. Behind damage the reading goes on at the next record that fits, found through the index at the end of the file
where that is sound, and otherwise by the beginning of a compressed chunk. Nothing is believed: lengths, sizes and the
number of damaged places are bounded, and memory holds one record at a time.
"""

from __future__ import annotations

import os
import struct
import zlib
from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TypeAlias

from manipcli.record.cdr import CdrError
from manipcli.record.columns import PAYLOAD, Places, walked
from manipcli.record.container import MAGIC
from manipcli.record.faults import BadRecording
from manipcli.record.scan import (
    ATTACHMENT,
    CHANNEL,
    CHUNK,
    DATA_END,
    FOOTER_RECORD,
    HEADER,
    MAX_NAMED,
    MAX_RECORD,
    MESSAGE,
    METADATA,
    RECORD_HEAD,
    SCHEMA,
    Record,
    first_bytes,
    is_finished,
    open_chunk,
    open_regular,
    read_head,
    readable,
)

if TYPE_CHECKING:
    from mcap.records import Attachment, Channel, Header, McapRecord, Metadata, Schema

    Declared: TypeAlias = Header | Schema | Channel | Attachment | Metadata

MAX_DAMAGED = 256
"""Places; in a file with more of them nothing is worth the time it takes."""
LOOSE = 1 << 20
"""[byte] Messages outside chunks are gathered until there are so many."""
STATISTICS, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX = 0x0B, 0x08, 0x0A, 0x0D
_LAST_OPCODE = 0x0F
_WORDS = {
    HEADER: "header",
    SCHEMA: "schema",
    CHANNEL: "channel",
    ATTACHMENT: "attachment",
    METADATA: "metadata record",
}
_WINDOW = 1 << 22
_CHUNK_MARKS = (b"\x04\x00\x00\x00zstd", b"\x03\x00\x00\x00lz4")
"""Name of the compression with its length, 28 bytes behind the body of a chunk begins."""
_MARK_AT = RECORD_HEAD.size + 28


@dataclass(frozen=True, slots=True)
class OpenChunk:
    """The messages of one chunk (of messages outside chunks, a megabyte of them): records as they stand in `data`."""

    data: bytes
    places: Mapping[int, Places]

    @property
    def start_ns(self) -> int:
        """Log time of its first message."""
        return min(int(places.times.min()) for places in self.places.values())


@dataclass(frozen=True, slots=True)
class Damage:
    """Bytes from `start` to `end` of the file that could not be read; `what` was there, as far as one can tell."""

    start: int
    end: int
    what: str


@dataclass(frozen=True, slots=True)
class Index:
    """What the end of a finished file says of it; empty where there is no sound one.

    Attributes:
        offsets: where chunks, attachments and metadata begin.
        messages: in the whole file; None where it does not say.
        declared: schemas and channels.
    """

    offsets: tuple[int, ...] = ()
    messages: int | None = None
    declared: tuple[McapRecord, ...] = ()


@dataclass(slots=True)
class Salvage:
    """Iterate once over what can be read, in the order of the file.

    Attributes:
        size: [byte] of the file.
        index: what its end says.
        end: why it is not whole at its end, or None.
    """

    path: Path
    size: int = 0
    index: Index = field(default_factory=Index)
    end: str | None = None
    _damaged: int = 0
    _named: int = 0
    _crc: int = 0

    def __iter__(self) -> Iterator[Declared | OpenChunk | Damage]:
        """
        Raises:
            BadRecording: no MCAP file at all, not readable, or damaged in too many places.
        """
        with readable(self.path), open_regular(self.path) as file:
            self.size = os.fstat(file.fileno()).st_size
            yield from self._pieces(file)

    def _pieces(self, file: BinaryIO) -> Iterator[Declared | OpenChunk | Damage]:
        finished = is_finished(file, self.size)
        self._crc = zlib.crc32(first_bytes(self.path, file))
        self.index = _index(file, self.size) if finished else Index()
        loose = bytearray()
        offset = len(MAGIC)
        while offset < self.size:
            record = _record_at(file, offset, self.size)
            if record is not None and record.opcode == DATA_END:
                yield from self._gathered(loose)
                if not finished:
                    self.end = "the index at its end is missing"
                elif not self._damaged and record.body not in (self._crc.to_bytes(4, "little"), bytes(4)):
                    yield self._damage(0, offset, "something that has no checksum of its own: a name, or metadata")
                return
            fault = ""
            if record is not None:
                head = RECORD_HEAD.pack(record.opcode, len(record.body))
                self._crc = zlib.crc32(record.body, zlib.crc32(head, self._crc))
                try:
                    if record.opcode == MESSAGE:
                        if len(record.body) < PAYLOAD - RECORD_HEAD.size:
                            raise CdrError("a message")
                        loose += head + record.body
                        if len(loose) >= LOOSE:
                            yield from self._gathered(loose)
                    else:
                        yield from self._read(record)
                except CdrError as error:
                    fault = str(error)
                else:
                    offset = record.end
                    continue
            following = self._following(file, offset, record)
            if following is None and record is None and not finished:
                self.end = "it was not finished, and is cut within a record"
                yield from self._gathered(loose)
                return
            yield from self._gathered(loose)
            following = self.size if following is None else following
            yield self._damage(offset, following, fault or f"{following - offset} bytes that hold no record")
            offset = following
        yield from self._gathered(loose)
        self.end = "its data has no end" if finished else "it was not finished"

    def _damage(self, start: int, end: int, what: str) -> Damage:
        self._damaged += 1
        if self._damaged > MAX_DAMAGED:
            raise BadRecording(self.path, f"is damaged in more than {MAX_DAMAGED} places")
        return Damage(start, end, what)

    def _gathered(self, loose: bytearray) -> Iterator[OpenChunk]:
        """The messages outside chunks so far, as one."""
        if loose:
            data = bytes(loose)
            loose.clear()
            yield OpenChunk(data, walked(data)[0])

    def _read(self, record: Record) -> Iterator[Declared | OpenChunk]:
        """What a record holds.

        Raises:
            CdrError: it is damaged; says what it was.
        """
        if record.opcode != CHUNK:
            if record.opcode in _WORDS:
                yield self._declared(record)
            return
        try:
            data = open_chunk(self.path, record)
        except BadRecording as error:
            raise CdrError(error.cause) from error
        places, others = walked(data)
        for opcode, body in others:
            if opcode in (SCHEMA, CHANNEL):
                yield self._declared(Record(opcode, record.offset, body))
        if places:
            yield OpenChunk(data, places)

    def _declared(self, record: Record) -> Declared:
        self._named += 1
        if self._named > MAX_NAMED:
            raise BadRecording(self.path, f"declares more than {MAX_NAMED} channels, schemas and attachments")
        return _declaration(record)

    def _following(self, file: BinaryIO, offset: int, record: Record | None) -> int | None:
        """Where to read on behind damage at `offset`; None where nothing more is found."""
        if record is not None:
            behind = _record_at(file, record.end, self.size)
            if record.end == self.size or (behind is not None and behind.opcode != MESSAGE):
                return record.end
        known = self.index.offsets
        if known:
            k = bisect_right(known, offset)
            return known[k] if k < len(known) else None
        return _next_chunk(file, offset + 1, self.size)


def _record_at(file: BinaryIO, offset: int, size: int) -> Record | None:
    """The record that begins there; None where none fits."""
    file.seek(offset)
    _, opcode, length = read_head(file)
    if not 0 < opcode <= _LAST_OPCODE or length > MAX_RECORD or offset + RECORD_HEAD.size + length > size:
        return None
    body = file.read(length)
    return Record(opcode, offset, body) if len(body) == length else None


def _next_chunk(file: BinaryIO, offset: int, size: int) -> int | None:
    """Where the next compressed chunk begins, at `offset` or behind it."""
    at = offset
    while at < size:
        file.seek(at)
        window = file.read(_WINDOW)
        begin = 0
        while True:
            found = [k for mark in _CHUNK_MARKS if (k := window.find(mark, begin)) >= 0]
            if not found:
                break
            begin = min(found) + 1
            start = at + min(found) - _MARK_AT
            if start >= offset and _is_chunk(file, start, size):
                return start
        at += max(len(window) - len(_CHUNK_MARKS[0]) + 1, 1)
    return None


def _is_chunk(file: BinaryIO, start: int, size: int) -> bool:
    """Whether the lengths of a chunk that begins at `start`, in the file and in itself, agree."""
    file.seek(start)
    head = file.read(RECORD_HEAD.size + 48)
    opcode, length = RECORD_HEAD.unpack_from(head) if len(head) == RECORD_HEAD.size + 48 else (0, 0)
    if opcode != CHUNK or length > MAX_RECORD or start + RECORD_HEAD.size + length > size:
        return False
    (name,) = struct.unpack_from("<I", head, _MARK_AT)
    (packed,) = struct.unpack_from("<Q", head, _MARK_AT + 4 + name)
    return bool(40 + name + packed == length)


def _declaration(record: Record) -> Declared:
    """
    Raises:
        CdrError: it cannot be read.
    """
    from mcap import records
    from mcap.data_stream import ReadDataStream, RecordBuilder
    from mcap.exceptions import McapError

    kinds: dict[int, type[Header | Schema | Channel | Attachment | Metadata]] = {
        HEADER: records.Header,
        SCHEMA: records.Schema,
        CHANNEL: records.Channel,
        ATTACHMENT: records.Attachment,
        METADATA: records.Metadata,
    }
    builder = RecordBuilder()
    try:
        # The library's readers carry no types.
        read: Declared = kinds[record.opcode].read(ReadDataStream(BytesIO(record.body)))
        read.write(builder)
        # The library's builder carries none either.
        again: bytes = builder.end()  # type: ignore[no-untyped-call]
    except (McapError, struct.error, UnicodeError) as error:
        raise CdrError(f"a {_WORDS[record.opcode]}") from error
    name = f"attachment '{read.name}'" if isinstance(read, records.Attachment) else f"a {_WORDS[record.opcode]}"
    if isinstance(read, records.Attachment):
        if int.from_bytes(record.body[-4:], "little") not in (0, zlib.crc32(record.body[:-4])):
            raise CdrError(name)
        again = again[:-4]
    # The library takes what is there where less is there than a length says. Later versions of the format may append.
    if not record.body.startswith(again[RECORD_HEAD.size :]):
        raise CdrError(name)
    return read


def _index(file: BinaryIO, size: int) -> Index:
    """What the summary of a finished file lists; nothing where its checksum does not hold."""
    from mcap import records
    from mcap.data_stream import ReadDataStream
    from mcap.exceptions import McapError

    file.seek(size - len(MAGIC) - FOOTER_RECORD.size)
    start, crc = FOOTER_RECORD.unpack(file.read(FOOTER_RECORD.size))[2:5:2]
    length = size - len(MAGIC) - FOOTER_RECORD.size - start
    if start == 0 or not 0 < length <= MAX_RECORD:
        return Index()
    file.seek(start)
    summary = file.read(length + FOOTER_RECORD.size)
    if crc not in (0, zlib.crc32(summary[:-4])):
        return Index()
    offsets: list[int] = []
    declared: list[McapRecord] = []
    messages: int | None = None
    at = 0
    try:
        while at < length:
            opcode, size_of = RECORD_HEAD.unpack_from(summary, at)
            body = summary[at + RECORD_HEAD.size : at + RECORD_HEAD.size + size_of]
            at += RECORD_HEAD.size + size_of
            stream = ReadDataStream(BytesIO(body))
            if opcode == SCHEMA:
                declared.append(records.Schema.read(stream))
            elif opcode == CHANNEL:
                declared.append(records.Channel.read(stream))
            elif opcode == STATISTICS:
                messages = records.Statistics.read(stream).message_count
            elif opcode == CHUNK_INDEX:
                offsets.append(records.ChunkIndex.read(stream).chunk_start_offset)
            elif opcode == ATTACHMENT_INDEX:
                offsets.append(records.AttachmentIndex.read(stream).offset)
            elif opcode == METADATA_INDEX:
                offsets.append(records.MetadataIndex.read(stream).offset)
    except (McapError, struct.error, UnicodeDecodeError):
        return Index()
    return Index(tuple(sorted({one for one in offsets if one < start})), messages, tuple(declared))
