"""The part of a recording around one time, found with the index at the end of its file."""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from manipcli.record import channels as topics
from manipcli.record.channels import ControllerChannel
from manipcli.record.contents import REPAIR, Contents
from manipcli.record.decode import Int
from manipcli.record.faults import BadRecording
from manipcli.record.read.reading import RecordReader
from manipcli.record.read.resync import read_index
from manipcli.record.read.scan import Record, chunk_at, guarded, is_finished, message_index, open_regular, readable
from manipcli.record.read.spans import FileSpans
from manipcli.record.recording import Recording, TaskEvent
from manipcli.record.records import (
    ATTACHMENT,
    CHANNEL,
    HEADER,
    LIBRARY,
    MAGIC,
    MAX_RECORD,
    MESSAGE_INDEX,
    METADATA,
    RECORD_HEAD,
    SCHEMA,
)

if TYPE_CHECKING:
    from mcap.records import ChunkIndex, Statistics
    from mcap.summary import Summary

BEFORE = 2
"""Chunks before that of a time: its state can be in the one before, and the velocities need the state before that."""


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A part of a recording.

    Attributes:
        recording: without embedded meshes; its spans are those around the time and that of the last change of contacts,
            its events those since a step started or ended.
        end: time of the last state of the whole recording [s].
        duration: time from its first to its last message [s].
    """

    recording: Recording
    end: float
    duration: float


def open_excerpt(path: Path, time: float) -> Excerpt | None:
    """What `open_recording` reads, as far as the state at `time` [s] depends on it.

    Returns:
        None if all of the file must be read to know: it is unfinished, damaged, repaired, written by another program,
        or has fewer messages than its period and duration say.
    """
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    try:
        with readable(path), open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            if not is_finished(file, size) or not read_index(file, size).offsets:
                return None
            file.seek(0)
            reader = make_reader(file)
            summary = reader.get_summary()
            if summary is None or summary.statistics is None or reader.get_header().library != LIBRARY:
                return None
            return _Search(path, file, summary, summary.statistics).excerpt(round(time * 1e9))
    except (BadRecording, McapError, ValueError, KeyError, IndexError, StopIteration, struct.error):
        # Reading all of it finds the reason.
        return None


class _Search:
    """Reads the needed records of a file with an intact summary."""

    def __init__(self, path: Path, file: BinaryIO, summary: Summary, statistics: Statistics) -> None:
        self._path = path
        self._file = file
        self._summary = summary
        self._statistics = statistics
        self._chunks = sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)
        self._topics = {channel.topic: channel.id for channel in summary.channels.values()}
        self._reader = RecordReader(path, contact_points=True)

    def excerpt(self, ns: int) -> Excerpt | None:
        """The excerpt at a time [ns]; see `open_excerpt`."""
        self._declarations()
        counts = self._statistics.channel_message_counts
        self._reader.heard(channel for channel, count in counts.items() if count)
        states = self._with(topics.JOINT_STATES)
        begun = sum(chunk.message_start_time <= ns for chunk in states)
        if not begun:
            return None
        near = states[max(begun - 1 - BEFORE, 0) : begun + 1]
        chosen = {chunk.chunk_start_offset for chunk in (*near, *self._contacts(ns))}
        recording = self._reader.recording(None)
        assert isinstance(recording.spans, FileSpans)
        end = int(self._times(states[-1], topics.JOINT_STATES)[-1])
        if REPAIR in recording.metadata or not self._complete(recording.spans.contents, end):
            return None
        spans = replace(recording.spans, chunks=tuple(sorted(chosen)), cut=True)
        duration = self._statistics.message_end_time - self._statistics.message_start_time
        return Excerpt(replace(recording, spans=spans, events=self._events(ns)), end / 1e9, duration / 1e9)

    def _declarations(self) -> None:
        """Read header, schemas, channels, metadata, and attachments other than meshes."""
        header = self._record(len(MAGIC), HEADER)
        self._reader.declaration(header)
        # The recorder writes schemas and channels behind the header.
        offset = header.end
        while (record := self._record(offset, None)).opcode in (SCHEMA, CHANNEL):
            self._reader.declaration(record)
            offset = record.end
        for index in self._summary.metadata_indexes:
            record = self._record(index.offset, METADATA)
            self._reader.declaration(record)
        for attachment in self._summary.attachment_indexes:
            if attachment.name not in self._reader.meshes:
                self._reader.declaration(self._record(attachment.offset, ATTACHMENT))

    def _record(self, offset: int, opcode: int | None) -> Record:
        """The record at an offset, of this kind."""
        self._file.seek(offset)
        head = self._file.read(RECORD_HEAD.size)
        found, length = RECORD_HEAD.unpack(head)
        if (opcode is not None and found != opcode) or length > MAX_RECORD:
            raise BadRecording(self._path, f"the record at byte {offset} is damaged")
        return Record(found, offset, self._file.read(length))

    def _with(self, topic: str) -> list[ChunkIndex]:
        """The chunks with messages of a topic."""
        channel = self._topics.get(topic)
        return [chunk for chunk in self._chunks if channel in chunk.message_index_offsets]

    def _times(self, chunk: ChunkIndex, topic: str) -> Int:
        """Log times [ns] of the messages of a topic in a chunk that has some."""
        record = self._record(chunk.message_index_offsets[self._topics[topic]], MESSAGE_INDEX)
        _, entries = guarded(self._path, record, message_index)
        return np.frombuffer(entries, dtype="<u8")[::2].astype(np.int64)

    def _contacts(self, ns: int) -> list[ChunkIndex]:
        """The chunk with the last contacts until a time."""
        for chunk in reversed(self._with(topics.CONTACTS)):
            if chunk.message_start_time <= ns and self._times(chunk, topics.CONTACTS)[0] <= ns:
                return [chunk]
        return []

    def _events(self, ns: int) -> tuple[TaskEvent, ...]:
        """Events from the chunk of the last start or end of a step until a time, at least."""
        found: tuple[TaskEvent, ...] = ()
        for chunk in reversed([one for one in self._with(topics.EVENTS) if one.message_start_time <= ns]):
            record, indexes = chunk_at(self._path, self._file, chunk.chunk_start_offset)
            channel = self._topics[topics.EVENTS]
            # Called at once, in the same turn of the loop.
            guarded(self._path, record, lambda record: self._reader.messages(record, {channel: indexes[channel]}))  # noqa: B023
            found = self._reader.taken_events() + found
            if any(event.kind in ("step_started", "step_ended") and event.time * 1e9 <= ns + 0.5 for event in found):
                break
        return found

    def _complete(self, contents: Contents, end: int) -> bool:
        """Whether every topic with a message per tick has all of them; a topic that another program thinned has not."""
        counts = self._statistics.channel_message_counts
        for topic in (topics.JOINT_STATES, topics.TF, *(self._state_topics(contents))):
            if topic not in contents.absent:
                stride = contents.strides.get(topic, 1) * contents.period * 1e9
                if abs(counts.get(self._topics[topic], 0) * stride - end) > 2.0 * stride:
                    return False
        return True

    def _state_topics(self, contents: Contents) -> list[str]:
        """Topics of the states of controllers that are always active."""
        return [
            ControllerChannel(name, ()).state_topic for name in contents.controllers if name not in contents.inactive
        ]
