"""Reads a recording back, from a finished file as from the one a killed run left behind.

One pass over the file verifies its checksum and keeps what is small; chunks are opened where that is needed only. The
ticks in them are read when somebody goes through the spans.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from manipcli.record import channels as topics
from manipcli.record import schemas
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.channels import ControllerChannel
from manipcli.record.contents import RECORD, REPAIR, Contents, contents
from manipcli.record.faults import BadRecording
from manipcli.record.read.chunk import indexed, open_chunk, singly, walked
from manipcli.record.read.scan import MAX_NAMED, Record, Scan, guarded
from manipcli.record.read.spans import FileSpans
from manipcli.record.recording import Recording, TaskEvent
from manipcli.record.records import ATTACHMENT, CHANNEL, CHUNK, HEADER, MESSAGE, METADATA, SCHEMA

if TYPE_CHECKING:
    from mcap.records import Attachment

MAX_ATTACHED = 1 << 30
"""[byte] of all attachments together."""


def open_recording(path: Path, *, being_written: bool = False) -> Recording:
    """A recording whose spans are read from the file when they are asked for: its memory does not grow with its length.

    Args:
        path: an `.mcap` file, or the `.mcap.partial` of a run that was killed.
        being_written: the file is a run's partial file that has just been flushed: that it has no end is no loss.

    Raises:
        BadRecording: not a recording of manipcli, of a later format, damaged, or out of bounds; from going through
            the spans, too. A file that merely lacks its end is read as far as it goes, and `lost` says so.
    """
    reader = _Reader(path)
    scan = Scan(path, being_written=being_written)
    for record, indexes in scan.pieces():
        if record.opcode == CHUNK:
            reader.chunk(record, indexes)
        else:
            reader.declaration(record)
    return reader.recording(scan.lost)


def read_recording(path: Path, *, being_written: bool = False) -> Recording:
    """Everything in one recording, all ticks in memory: see `open_recording`, and `Recording.whole`."""
    return open_recording(path, being_written=being_written).whole()


class _Reader:
    """What was declared so far, and what happened."""

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
        self._events: list[TaskEvent] = []
        self._chunks: list[int] = []
        self._newest = -1
        self._heard: set[str] = set()

    def declaration(self, record: Record) -> None:
        """Anything but a chunk."""
        if record.opcode in (SCHEMA, CHANNEL, ATTACHMENT, METADATA):
            self._named += 1
            if self._named > MAX_NAMED:
                raise BadRecording(self._path, f"declares more than {MAX_NAMED} channels, schemas and attachments")
        elif record.opcode == MESSAGE:
            raise BadRecording(self._path, "has messages outside chunks; manipcli writes none")
        guarded(self._path, record, self._declaration)

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
        self._types = {
            topics.JOINT_STATES: schemas.JOINT_STATE,
            topics.TF: schemas.TF_MESSAGE,
            topics.EVENTS: schemas.TASK_EVENT,
            topics.CONTACTS: schemas.CONTACTS,
        }
        for name in self._contents.controllers:
            self._types[ControllerChannel(name, ()).state_topic] = schemas.CONTROLLER_STATE
        for topic in self._contents.absent:
            self._types.pop(topic, None)

    def chunk(self, record: Record, indexes: Mapping[int, bytes]) -> None:
        """A chunk; its indexes say whether anything in it is needed yet."""
        self._known()
        self._chunks.append(record.offset)
        of = {channel: self._channels.get(channel, ("", ""))[0] for channel in indexes}
        if not indexes or "" in of.values():
            guarded(self._path, record, lambda record: self._opened(record, {}))
            return
        needed = {channel: raw for channel, raw in indexes.items() if of[channel] == topics.EVENTS}
        if needed:
            guarded(self._path, record, lambda record: self._opened(record, needed))
        self._heard.update(of[channel] for channel, entries in indexes.items() if entries)
        for channel, entries in indexes.items():
            if of[channel] == topics.JOINT_STATES and entries:
                self._newest = int.from_bytes(entries[-16:-8], "little")

    def _opened(self, record: Record, needed: Mapping[int, bytes]) -> None:
        """What the indexes `needed` point at; where there are none, all that is needed."""
        data = open_chunk(self._path, record)
        places = indexed(data, needed, whole=False)
        if places is None:
            # The indexes were cut off, or another tool wrote the file.
            places, others = walked(data)
            for opcode, body in others:
                self.declaration(Record(opcode, record.offset, body))
        for channel, found in places.items():
            if channel not in self._channels:
                raise CdrError(f"it has a message of channel {channel}, which is not declared")
            topic, _ = self._channels[channel]
            self._heard.add(topic)
            if topic == topics.EVENTS:
                self._events += [_event(ns, reader) for ns, reader in singly(data, found)]
            elif topic == topics.JOINT_STATES:
                self._newest = int(found.times[-1])

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
        known = self._known()
        there = {topic for topic, _ in self._channels.values()}
        missing = [f"{topic} ({kind})" for topic, kind in self._types.items() if topic not in there]
        if missing:
            raise BadRecording(self._path, f"is not a recording of manipcli: it lacks {', '.join(missing)}")
        for topic, kind in self._channels.values():
            if kind != self._types.get(topic, kind):
                raise BadRecording(self._path, f"{topic} is not of type {self._types[topic]}")
        if lost is not None and self._newest >= 0:
            lost = f"{lost}; recorded until t = {self._newest / 1e9:.3f} s"
        if REPAIR in self._metadata:
            repaired = f"it was repaired, and lacks what was lost {self._metadata[REPAIR].get('lost', '')}"
            lost = repaired if lost is None else f"{repaired}; {lost}"
        return Recording(
            joint_names=known.joints,
            body_names=known.bodies,
            spans=FileSpans(
                path=self._path,
                contents=known,
                channels={channel: topic for channel, (topic, _) in self._channels.items()},
                chunks=tuple(self._chunks),
                cut=lost is not None,
            ),
            events=tuple(self._events),
            metadata=self._metadata,
            attachments=self._attachments,
            lost=lost,
            period=known.period,
            absent=known.absent,
            silent=tuple(topic for topic in self._types if topic not in self._heard),
        )


def _event(ns: int, reader: CdrReader) -> TaskEvent:
    reader.header()
    kind, step, verb, outcome, text, place = (reader.text() for _ in range(6))
    return TaskEvent(time=ns / 1e9, kind=kind, step=step, verb=verb, outcome=outcome, text=text, place=place)
