"""Recovery of the undamaged content of any MCAP file.

Every part is verified separately: chunks and attachments by their checksums, other records by decoding them.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from manipcli.record.cdr import CdrError
from manipcli.record.faults import BadRecording
from manipcli.record.read.chunk import Places, open_chunk, walked
from manipcli.record.read.scan import MAX_NAMED, Damage, Record, Scan
from manipcli.record.records import (
    ATTACHMENT,
    CHANNEL,
    CHUNK,
    HEADER,
    MESSAGE,
    METADATA,
    PAYLOAD,
    RECORD_HEAD,
    SCHEMA,
)

if TYPE_CHECKING:
    from mcap.records import Attachment, Channel, Header, Metadata, Schema

    Declared: TypeAlias = Header | Schema | Channel | Attachment | Metadata

LOOSE = 1 << 20
"""Largest block of messages outside chunks [byte]."""
_WORDS = {
    HEADER: "header",
    SCHEMA: "schema",
    CHANNEL: "channel",
    ATTACHMENT: "attachment",
    METADATA: "metadata record",
}


@dataclass(frozen=True, slots=True)
class Stretch:
    """The messages of one chunk, or consecutive messages outside chunks, as records in `data`.

    `start`, `end`: offsets of its records in the file.
    """

    start: int
    end: int
    chunk: bool
    data: bytes
    places: Mapping[int, Places]


class Salvage:
    """Iterates once over the readable parts in the order of the file; `scan` has its index and what is missing."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.scan = Scan(path, damaged=True)
        self._named = 0
        self._loose = bytearray()
        self._loose_start = 0

    def __iter__(self) -> Iterator[Declared | Stretch | Damage]:
        """
        Raises:
            BadRecording: not an MCAP file, not readable, or damaged in too many places.
        """
        for record in self.scan:
            if isinstance(record, Damage) or record.opcode != MESSAGE or len(self._loose) >= LOOSE:
                yield from self._gathered()
            if isinstance(record, Damage):
                yield record
                continue
            try:
                if record.opcode == MESSAGE:
                    self._gather(record)
                else:
                    yield from self._read(record)
            except CdrError as error:
                self.scan.fault = str(error)
        yield from self._gathered()

    def _gather(self, record: Record) -> None:
        if len(record.body) < PAYLOAD - RECORD_HEAD.size:
            raise CdrError("a message")
        if not self._loose:
            self._loose_start = record.offset
        self._loose += RECORD_HEAD.pack(record.opcode, len(record.body)) + record.body

    def _gathered(self) -> Iterator[Stretch]:
        """The collected messages outside chunks, as one block."""
        if self._loose:
            data, start = bytes(self._loose), self._loose_start
            self._loose.clear()
            yield Stretch(start, start + len(data), False, data, walked(data)[0])

    def _read(self, record: Record) -> Iterator[Declared | Stretch]:
        """
        Raises:
            CdrError: the record is damaged; its message names the record.
        """
        if record.opcode in _WORDS:
            yield self._declared(record)
        if record.opcode != CHUNK:
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
            yield Stretch(record.offset, record.end, True, data, places)

    def _declared(self, record: Record) -> Declared:
        self._named += 1
        if self._named > MAX_NAMED:
            raise BadRecording(self.path, f"more than {MAX_NAMED} channels, schemas and attachments")
        return _declaration(record)


def _declaration(record: Record) -> Declared:
    """
    Raises:
        CdrError: the record cannot be read.
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
        # The readers of the library have no types.
        read: Declared = kinds[record.opcode].read(ReadDataStream(BytesIO(record.body)))
        read.write(builder)
        # The builder of the library has no types.
        encoded: bytes = builder.end()  # type: ignore[no-untyped-call]
    except (McapError, struct.error, UnicodeError) as error:
        raise CdrError(f"a {_WORDS[record.opcode]}") from error
    name = f"attachment '{read.name}'" if isinstance(read, records.Attachment) else f"a {_WORDS[record.opcode]}"
    if isinstance(read, records.Attachment):
        if int.from_bytes(record.body[-4:], "little") not in (0, zlib.crc32(record.body[:-4])):
            raise CdrError(name)
        encoded = encoded[:-4]
    # The library accepts truncated records, so compare with the encoded record. Later formats can append fields.
    if not record.body.startswith(encoded[RECORD_HEAD.size :]):
        raise CdrError(name)
    return read
