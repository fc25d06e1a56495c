"""Reader of recordings, finished or left by a killed run.

One pass over the file verifies its checksum and reads small records; chunks are opened only if needed. Iterating over
the spans reads the ticks.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Transform, frozen
from manipcli.record import channels as topics
from manipcli.record import schemas
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.channels import ControllerChannel
from manipcli.record.contents import RECORD, REPAIR, Contents, contents
from manipcli.record.faults import BadRecording
from manipcli.record.read.chunk import indexed, open_chunk, singly, walked
from manipcli.record.read.contacts import have_points
from manipcli.record.read.scan import MAX_NAMED, Record, Scan, guarded
from manipcli.record.read.spans import FileSpans
from manipcli.record.recording import EMBEDDED, BeliefSnapshot, Recording, TaskEvent
from manipcli.record.records import ATTACHMENT, CHANNEL, CHUNK, HEADER, MESSAGE, METADATA, SCHEMA

if TYPE_CHECKING:
    from mcap.records import Attachment

UNIT = 1e-6
"""Largest difference of the length of a quaternion from 1."""
MAX_ATTACHED = 1 << 30
"""Largest size of all attachments together [byte]."""


def open_recording(path: Path, *, being_written: bool = False, contact_points: bool = True) -> Recording:
    """Open a recording whose spans are read from the file on demand, with memory independent of its length.

    Args:
        path: an `.mcap` file, or the `.mcap.partial` file of a killed run.
        being_written: the run has just flushed this partial file, so its missing end is not a loss.
        contact_points: read the points of contacts, which verdicts do not need.

    Raises:
        BadRecording: not a recording of manipcli, of a later format, damaged, or too large; also while
            iterating over the spans. A file without its end is read up to there, with the reason in `lost`.
    """
    reader = RecordReader(path, contact_points=contact_points)
    scan = Scan(path, being_written=being_written)
    for record, indexes in scan.pieces():
        if record.opcode == CHUNK:
            reader.chunk(record, indexes)
        else:
            reader.declaration(record)
    return reader.recording(scan.lost)


def read_recording(path: Path, *, being_written: bool = False) -> Recording:
    """Read a recording with all ticks in memory; see `open_recording` and `Recording.whole`."""
    return open_recording(path, being_written=being_written).whole()


class RecordReader:
    """State while reading the records of a file."""

    def __init__(self, path: Path, *, contact_points: bool) -> None:
        self._path = path
        self._skip_points = not contact_points
        self._named = 0
        self._attached = 0
        self._schemas: dict[int, str] = {}
        self._points = True
        self._channels: dict[int, tuple[str, str]] = {}
        self._metadata: dict[str, dict[str, str]] = {}
        self._attachments: dict[str, bytes] = {}
        self._contents: Contents | None = None
        self._types: dict[str, str] = {}
        self._events: list[TaskEvent] = []
        self._beliefs: list[BeliefSnapshot] = []
        self._chunks: list[int] = []
        self._newest = -1
        self._heard: set[str] = set()

    def declaration(self, record: Record) -> None:
        """Read a record that is not a chunk."""
        if record.opcode in (SCHEMA, CHANNEL, ATTACHMENT, METADATA):
            self._named += 1
            if self._named > MAX_NAMED:
                raise BadRecording(self._path, f"more than {MAX_NAMED} channels, schemas and attachments")
        elif record.opcode == MESSAGE:
            raise BadRecording(self._path, "not a log of manipcli: messages outside chunks")
        guarded(self._path, record, self._declaration)

    def _declaration(self, record: Record) -> None:
        from mcap import records
        from mcap.data_stream import ReadDataStream

        stream = ReadDataStream(BytesIO(record.body))
        if record.opcode == HEADER:
            if records.Header.read(stream).profile != "ros2":
                raise BadRecording(self._path, "not a recording of manipcli: its profile is not ros2")
        elif record.opcode == SCHEMA:
            schema = records.Schema.read(stream)
            self._schemas[schema.id] = schema.name
            if schema.name == schemas.CONTACTS:
                try:
                    self._points = have_points(schema.data.decode())
                except ValueError as error:
                    raise BadRecording(self._path, str(error)) from error
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
        # Keep only the last part of the name, so that an attachment cannot leave its output directory.
        name = PurePosixPath(attachment.name.replace("\\", "/").replace("\0", "")).name
        self._attached += len(attachment.data)
        if name in ("", "..") or name in self._attachments or self._attached > MAX_ATTACHED:
            raise CdrError(f"attachment '{attachment.name}' has a missing or duplicate name, or is too large")
        self._attachments[name] = attachment.data

    def _expect(self, values: Mapping[str, str]) -> None:
        """Prepare for the contents that the metadata declares."""
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
        if self._contents.believed:
            self._types[topics.BELIEF_TF] = schemas.TF_MESSAGE
        for topic in self._contents.absent:
            self._types.pop(topic, None)

    def chunk(self, record: Record, indexes: Mapping[int, bytes]) -> None:
        """Register a chunk, and open it if its indexes have needed messages."""
        self._known()
        self._chunks.append(record.offset)
        of = {channel: self._channels.get(channel, ("", ""))[0] for channel in indexes}
        if not indexes or "" in of.values():
            guarded(self._path, record, lambda record: self.messages(record, {}))
            return
        needed = {
            channel: raw for channel, raw in indexes.items() if of[channel] == topics.EVENTS or believes(of[channel])
        }
        if needed:
            guarded(self._path, record, lambda record: self.messages(record, needed))
        self._heard.update(of[channel] for channel, entries in indexes.items() if entries)
        for channel, entries in indexes.items():
            if of[channel] == topics.JOINT_STATES and entries:
                self._newest = int.from_bytes(entries[-16:-8], "little")

    def messages(self, record: Record, needed: Mapping[int, bytes]) -> None:
        """Read the messages of the indexes `needed`; without indexes, search the chunk."""
        data = open_chunk(self._path, record)
        places = indexed(data, needed, whole=False)
        if places is None:
            # The indexes are truncated, or another tool wrote the file.
            places, others = walked(data)
            for opcode, body in others:
                self.declaration(Record(opcode, record.offset, body))
        for channel, found in places.items():
            if channel not in self._channels:
                raise CdrError(f"a message of channel {channel}, which is not declared")
            topic, _ = self._channels[channel]
            self._heard.add(topic)
            if topic == topics.EVENTS:
                self._events += [_event(ns, reader) for ns, reader in singly(data, found)]
            elif believes(topic):
                self._beliefs += [_belief(topic, ns, reader) for ns, reader in singly(data, found)]
            elif topic == topics.JOINT_STATES:
                self._newest = int(found.times[-1])

    def _known(self) -> Contents:
        """The declared contents; raises if they are missing."""
        if self._contents is None:
            raise BadRecording(
                self._path,
                f"not a recording of manipcli: no metadata record '{RECORD}' before its messages",
            )
        return self._contents

    def heard(self, channels: Iterable[int]) -> None:
        """Note channels with messages, also in chunks that are not read."""
        self._heard.update(self._channels[channel][0] for channel in channels if channel in self._channels)

    @property
    def meshes(self) -> frozenset[str]:
        """Names of the attachments that are embedded meshes, by the metadata read so far."""
        return frozenset(self._metadata.get(EMBEDDED, {}).values())

    def taken_events(self) -> tuple[TaskEvent, ...]:
        """The events read since the last call."""
        found, self._events = tuple(self._events), []
        return found

    def recording(self, lost: str | None) -> Recording:
        """The recording of the records that were read."""
        known = self._known()
        there = {topic for topic, _ in self._channels.values()}
        missing = [f"{topic} ({kind})" for topic, kind in self._types.items() if topic not in there]
        if missing:
            raise BadRecording(self._path, f"not a recording of manipcli: missing {', '.join(missing)}")
        for topic, kind in self._channels.values():
            if kind != self._types.get(topic, kind):
                raise BadRecording(self._path, f"{topic} is not of type {self._types[topic]}")
        inactive = [ControllerChannel(name, ()).state_topic for name in known.inactive]
        if lost is not None and self._newest >= 0:
            lost = f"{lost}; recorded until t = {self._newest / 1e9:.3f} s"
        if REPAIR in self._metadata:
            repaired = f"repaired with losses {self._metadata[REPAIR].get('lost', '')}"
            lost = repaired if lost is None else f"{repaired}; {lost}"
        return Recording(
            joint_names=known.joints,
            body_names=known.bodies,
            believed_names=known.believed,
            beliefs=tuple(self._beliefs),
            spans=FileSpans(
                path=self._path,
                contents=known,
                channels={channel: topic for channel, (topic, _) in self._channels.items()},
                chunks=tuple(self._chunks),
                cut=lost is not None,
                points=self._points,
                skip_points=self._skip_points,
            ),
            events=tuple(self._events),
            metadata=self._metadata,
            attachments=self._attachments,
            lost=lost,
            period=known.period,
            absent=known.absent,
            silent=tuple(topic for topic in self._types if topic not in {*self._heard, *inactive}),
        )


def believes(topic: str) -> bool:
    """Whether a topic has the believed poses of one uncertain body."""
    return topic.startswith(f"{topics.BELIEF}/") and topic != topics.BELIEF_TF


def _belief(topic: str, ns: int, reader: CdrReader) -> BeliefSnapshot:
    reader.header()
    pose, covariance = (np.array([reader.f64() for _ in range(count)]) for count in (7, 36))
    if not abs(float(np.linalg.norm(pose[3:])) - 1.0) <= UNIT:
        raise CdrError(f"a quaternion of {topic} is not of length 1")
    X_WO = Transform.of(xyz=pose[:3], quat_xyzw=pose[3:])
    body = topic.removeprefix(f"{topics.BELIEF}/")
    return BeliefSnapshot(ns / 1e9, body, X_WO, frozen(covariance.reshape(6, 6)))


def _event(ns: int, reader: CdrReader) -> TaskEvent:
    reader.header()
    kind, step, verb, outcome, text, place = (reader.text() for _ in range(6))
    return TaskEvent(time=ns / 1e9, kind=kind, step=step, verb=verb, outcome=outcome, text=text, place=place)
