"""Reads a recording back: all ticks at once, from a finished file as from the one a killed run left behind."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, TypeVar

from manipcli.model.state import Contact
from manipcli.record import channels as topics
from manipcli.record import schemas
from manipcli.record.assembly import assemble
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.channels import ControllerChannel
from manipcli.record.columns import (
    Columns,
    Places,
    body_layout,
    controller_state_layout,
    indexed,
    joint_state_layout,
    walked,
)
from manipcli.record.contents import RECORD, Contents, contents
from manipcli.record.faults import BadRecording
from manipcli.record.messages import WORLD
from manipcli.record.recording import ContactSnapshot, Recording, TaskEvent
from manipcli.record.scan import (
    ATTACHMENT,
    CHANNEL,
    CHUNK,
    HEADER,
    MESSAGE,
    MESSAGE_INDEX,
    METADATA,
    SCHEMA,
    Record,
    Scan,
    open_chunk,
)

if TYPE_CHECKING:
    from mcap.records import Attachment

MAX_NAMED = 4096
"""Channels, schemas, attachments and metadata records in one file."""

MAX_ATTACHED = 1 << 30
"""[byte] of all attachments together."""

R = TypeVar("R")


def read_recording(path: Path, *, being_written: bool = False) -> Recording:
    """Everything in one recording.

    Args:
        path: an `.mcap` file, or the `.mcap.partial` of a run that was killed.
        being_written: the file is a run's partial file that has just been flushed: that it has no end is no loss.

    Raises:
        BadRecording: not a recording of manipcli, of a later format, damaged, or out of bounds. A file that merely
            lacks its end is read as far as it goes, and `lost` says so.
    """
    reader = _Reader(path)
    scan = Scan(path, being_written=being_written)
    chunk: Record | None = None
    indexes: dict[int, bytes] = {}
    for record in scan:
        if record.opcode == MESSAGE_INDEX:
            channel, entries = reader.guarded(record, _message_index)
            indexes[channel] = entries
            continue
        if chunk is not None:
            reader.chunk(chunk, indexes)
        chunk, indexes = (record if record.opcode == CHUNK else None), {}
        if chunk is None:
            reader.declaration(record)
    if chunk is not None:
        reader.chunk(chunk, indexes)
    return reader.recording(scan.lost)


class _Reader:
    """What was declared so far, and the columns that grow chunk by chunk."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._named = 0
        self._attached = 0
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str]] = {}
        self._metadata: dict[str, dict[str, str]] = {}
        self._attachments: dict[str, bytes] = {}
        self._contents: Contents | None = None
        self._types: dict[str, str] = {}
        self._columns: dict[str, Columns] = {}
        self._contacts: list[ContactSnapshot] = []
        self._events: list[TaskEvent] = []

    def guarded(self, record: Record, read: Callable[[Record], R]) -> R:
        """What `read` makes of a record; what it stumbles over becomes an error that says where."""
        from mcap.exceptions import McapError

        try:
            return read(record)
        except (McapError, CdrError, struct.error, UnicodeDecodeError) as error:
            cause = f": {error}" if isinstance(error, CdrError) else ""
            raise BadRecording(self._path, f"the record at byte {record.offset} is damaged{cause}") from error

    def declaration(self, record: Record) -> None:
        """Anything but a chunk."""
        if record.opcode in (SCHEMA, CHANNEL, ATTACHMENT, METADATA):
            self._named += 1
            if self._named > MAX_NAMED:
                raise BadRecording(self._path, f"declares more than {MAX_NAMED} channels, schemas and attachments")
        elif record.opcode == MESSAGE:
            raise BadRecording(self._path, "has messages outside chunks; manipcli writes none")
        self.guarded(record, self._declaration)

    def _declaration(self, record: Record) -> None:
        from mcap import records
        from mcap.data_stream import ReadDataStream

        stream = ReadDataStream(BytesIO(record.body))
        if record.opcode == HEADER:
            if records.Header.read(stream).profile != "ros2":
                raise BadRecording(self._path, "is not a recording of manipcli: its profile is not ros2")
        elif record.opcode == SCHEMA:
            schema = records.Schema.read(stream)
            self._schemas[schema.id] = schema.name
        elif record.opcode == CHANNEL:
            channel = records.Channel.read(stream)
            kind = self._schemas.get(channel.schema_id, "") if channel.message_encoding == "cdr" else ""
            self._channels[channel.id] = (channel.topic, kind)
        elif record.opcode == METADATA:
            metadata = records.Metadata.read(stream)
            self._metadata.setdefault(metadata.name, {}).update(metadata.metadata)
            if metadata.name == RECORD:
                self._expect(metadata.metadata)
        elif record.opcode == ATTACHMENT:
            self._attachment(record, records.Attachment.read(stream))

    def _attachment(self, record: Record, attachment: Attachment) -> None:
        if zlib.crc32(record.body[:-4]) != int.from_bytes(record.body[-4:], "little"):
            raise CdrError(f"the checksum of attachment '{attachment.name}' does not match")
        # Only the last part of a name is taken: a log must not name a place outside the directory it is unpacked to.
        name = PurePosixPath(attachment.name.replace("\\", "/").replace("\0", "")).name
        self._attached += len(attachment.data)
        if name in ("", "..") or name in self._attachments or self._attached > MAX_ATTACHED:
            raise CdrError(f"attachment '{attachment.name}' has no name of its own, or is too large")
        self._attachments[name] = attachment.data

    def _expect(self, values: Mapping[str, str]) -> None:
        """Prepares for what the recorder says the file holds."""
        try:
            self._contents = contents(values)
        except ValueError as error:
            raise BadRecording(self._path, str(error)) from error
        self._columns = {
            topics.JOINT_STATES: Columns(joint_state_layout),
            topics.TF: Columns(body_layout(frozenset(self._contents.bodies), WORLD)),
        }
        self._types = {
            topics.JOINT_STATES: schemas.JOINT_STATE,
            topics.TF: schemas.TF_MESSAGE,
            topics.EVENTS: schemas.TASK_EVENT,
            topics.CONTACTS: schemas.CONTACTS,
        }
        for name in self._contents.controllers:
            topic = ControllerChannel(name, ()).state_topic
            self._columns[topic] = Columns(controller_state_layout)
            self._types[topic] = schemas.CONTROLLER_STATE

    def chunk(self, record: Record, indexes: Mapping[int, bytes]) -> None:
        self.guarded(record, lambda record: self._chunk(record, indexes))

    def _chunk(self, record: Record, indexes: Mapping[int, bytes]) -> None:
        self._known()
        data = open_chunk(self._path, record)
        places = indexed(data, indexes)
        if places is None:
            # The indexes were cut off, or another tool wrote the file: every message is looked at.
            places, others = walked(data)
            for opcode, body in others:
                self.declaration(Record(opcode, record.offset, body))
        for channel, found in places.items():
            if channel not in self._channels:
                raise CdrError(f"it has a message of channel {channel}, which is not declared")
            topic, kind = self._channels[channel]
            if kind != self._types.get(topic, kind):
                raise CdrError(f"{topic} is not of type {self._types[topic]}")
            if topic in self._columns:
                self._columns[topic].add(data, found)
            elif topic == topics.CONTACTS:
                self._contacts += [ContactSnapshot(ns / 1e9, _contacts(reader)) for ns, reader in _singly(data, found)]
            elif topic == topics.EVENTS:
                self._events += [_event(ns, reader) for ns, reader in _singly(data, found)]

    def _known(self) -> Contents:
        """What the file holds, once it is sure that it holds it."""
        if self._contents is None:
            raise BadRecording(
                self._path,
                f"is not a recording of manipcli: no metadata record '{RECORD}' comes before its messages",
            )
        return self._contents

    def recording(self, lost: str | None) -> Recording:
        """All of it, put together."""
        there = {topic for topic, _ in self._channels.values()}
        missing = [f"{topic} ({kind})" for topic, kind in self._types.items() if topic not in there]
        if self._contents is not None and missing:
            raise BadRecording(self._path, f"is not a recording of manipcli: it lacks {', '.join(missing)}")
        return assemble(
            self._path,
            self._known(),
            self._columns,
            contacts=tuple(self._contacts),
            events=tuple(self._events),
            metadata=self._metadata,
            attachments=self._attachments,
            lost=lost,
        )


def _message_index(record: Record) -> tuple[int, bytes]:
    """Channel, and the pairs of log time and offset as they stand."""
    channel, length = struct.unpack_from("<HI", record.body)
    if length != len(record.body) - 6 or length % 16:
        raise CdrError("a message index has another length than it says")
    return channel, record.body[6:]


def _singly(data: bytes, places: Places) -> Iterator[tuple[int, CdrReader]]:
    """(log time [ns], reader) of each message."""
    view = memoryview(data)
    for ns, start, length in zip(places.times.tolist(), places.starts.tolist(), places.lengths.tolist(), strict=True):
        yield ns, CdrReader(view[start : start + length])


def _contacts(reader: CdrReader) -> tuple[Contact, ...]:
    reader.header()
    return tuple(
        Contact(a=reader.text(), b=reader.text(), force=reader.f64(), distance=reader.f64())
        for _ in range(reader.count(16))
    )


def _event(ns: int, reader: CdrReader) -> TaskEvent:
    reader.header()
    kind, step, verb, outcome, text, place = (reader.text() for _ in range(6))
    return TaskEvent(time=ns / 1e9, kind=kind, step=step, verb=verb, outcome=outcome, text=text, place=place)
