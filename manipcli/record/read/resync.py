"""Resynchronisation after damage in an MCAP file, by its index or by the start of a compressed chunk."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, BinaryIO

from manipcli.record.records import CHUNK, FOOTER_RECORD, MAGIC, MAX_RECORD, RECORD_HEAD

if TYPE_CHECKING:
    from mcap.records import Channel, Schema

_WINDOW = 1 << 22
_CHUNK_MARKS = (b"\x04\x00\x00\x00zstd", b"\x03\x00\x00\x00lz4")
"""Name of the compression with its length, 28 bytes after the start of a chunk body."""
_MARK_AT = RECORD_HEAD.size + 28


@dataclass(frozen=True, slots=True)
class Index:
    """Index at the end of a finished file; empty if missing or damaged.

    Attributes:
        offsets: start offsets of chunks, attachments and metadata.
        messages: number of messages in the file; None if unknown.
        declared: declared schemas and channels.
    """

    offsets: tuple[int, ...] = ()
    messages: int | None = None
    declared: tuple[Schema | Channel, ...] = ()


def read_index(file: BinaryIO, size: int) -> Index:
    """The index of a finished file; empty if its checksum does not match."""
    from mcap import records
    from mcap.exceptions import McapError
    from mcap.stream_reader import StreamReader

    file.seek(size - len(MAGIC) - FOOTER_RECORD.size)
    start, crc = FOOTER_RECORD.unpack(file.read(FOOTER_RECORD.size))[2:5:2]
    length = size - len(MAGIC) - start
    if start == 0 or not FOOTER_RECORD.size < length <= MAX_RECORD:
        return Index()
    file.seek(start)
    summary = file.read(length)
    if crc not in (0, zlib.crc32(summary[:-4])):
        return Index()
    offsets: set[int] = set()
    declared: list[Schema | Channel] = []
    messages: int | None = None
    # Chunks are not decompressed here.
    reader = StreamReader(BytesIO(summary + MAGIC), skip_magic=True, emit_chunks=True, record_size_limit=length)
    try:
        for record in reader.records:
            match record:
                case records.Schema() | records.Channel():
                    declared.append(record)
                case records.Statistics():
                    messages = record.message_count
                case records.ChunkIndex():
                    offsets.add(record.chunk_start_offset)
                case records.AttachmentIndex() | records.MetadataIndex():
                    offsets.add(record.offset)
    except (McapError, struct.error, UnicodeDecodeError):
        return Index()
    return Index(tuple(sorted(offset for offset in offsets if offset < start)), messages, tuple(declared))


def next_chunk(file: BinaryIO, offset: int, size: int) -> int | None:
    """Offset of the next compressed chunk at or after `offset`; None without one."""
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
    """Whether the lengths inside a chunk at `start` match the length of its record."""
    file.seek(start)
    head = file.read(RECORD_HEAD.size + 48)
    opcode, length = RECORD_HEAD.unpack_from(head) if len(head) == RECORD_HEAD.size + 48 else (0, 0)
    if opcode != CHUNK or length > MAX_RECORD or start + RECORD_HEAD.size + length > size:
        return False
    (name,) = struct.unpack_from("<I", head, _MARK_AT)
    (packed,) = struct.unpack_from("<Q", head, _MARK_AT + 4 + name)
    return bool(40 + name + packed == length)
