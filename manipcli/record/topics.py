"""What any ROS 2 log holds: its topics, their types, and where their messages stand. Knows no robot and no task.

One pass verifies the file and opens a chunk only where it does not say from outside what it holds.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np

from manipcli.record.cdr import CdrError
from manipcli.record.columns import Int, Places, indexed, walked
from manipcli.record.faults import BadRecording
from manipcli.record.scan import (
    CHANNEL,
    CHUNK,
    MAX_NAMED,
    MESSAGE,
    RECORD_HEAD,
    SCHEMA,
    ChunkPlace,
    Piece,
    Record,
    Scan,
    guarded,
    message_index,
    open_chunk,
    readable,
    records_at,
)

RUN = 1 << 22
"""[byte] Messages outside chunks are taken together up to this."""


@dataclass(slots=True)
class Topic:
    """One topic.

    Attributes:
        name: `/joint_states`.
        type: `sensor_msgs/msg/JointState`, as the log calls it.
        definition: the text of the schema; "" where it is not `ros2msg`, or messages are not CDR.
        encoding: how messages are written, `cdr`.
        count: messages.
        first, last: log times [ns]; 0 where there is no message.
    """

    name: str
    type: str
    definition: str
    encoding: str
    count: int = 0
    first: int = 0
    last: int = 0

    def saw(self, times: Int) -> None:
        """Counts messages."""
        if len(times):
            low, high = int(times.min()), int(times.max())
            self.first = low if self.count == 0 else min(self.first, low)
            self.last = high if self.count == 0 else max(self.last, high)
            self.count += len(times)


@dataclass(frozen=True, slots=True)
class _Place:
    """A stretch of the file that holds messages: a chunk, or messages that are in none; of which channels."""

    at: ChunkPlace
    chunk: bool
    channels: frozenset[int]


@dataclass(frozen=True)
class Topics:
    """The topics of a log by name, and its messages.

    Attributes:
        path: the file.
        all: by name, in the order in which they were declared.
        lost: why the end is missing, or None.
    """

    path: Path
    all: Mapping[str, Topic]
    lost: str | None
    _channels: Mapping[int, str] = field(repr=False)
    _places: tuple[_Place, ...] = field(repr=False)

    @property
    def start(self) -> int:
        """[ns] log time of the first message."""
        return min((topic.first for topic in self.all.values() if topic.count), default=0)

    @property
    def end(self) -> int:
        """[ns] log time of the last message."""
        return max((topic.last for topic in self.all.values() if topic.count), default=0)

    def messages(self, names: Collection[str]) -> Iterator[tuple[str, bytes, Places]]:
        """The messages of some topics: name, bytes, and where in them they are; in the order of the file.

        Raises:
            BadRecording: a chunk is damaged, or the file changed.
        """
        wanted = {number: name for number, name in self._channels.items() if name in names}
        with readable(self.path), self.path.open("rb") as file:
            for place in self._places:
                if not place.channels.isdisjoint(wanted):
                    for number, data, found in _read(self.path, file, place, frozenset(wanted)):
                        yield wanted[number], data, found


def open_topics(path: Path) -> Topics:
    """The topics of a log, finished or not.

    Raises:
        BadRecording: it is no MCAP file, or damaged.
    """
    reader = _Reader(path)
    scan = Scan(path)
    for piece in scan.pieces():
        reader.take(piece)
    reader.close_run()
    return Topics(path, reader.topics, scan.lost, reader.channels, tuple(reader.places))


class _Reader:
    """What was declared so far."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._named = 0
        self._run: list[Record] = []
        self._run_size = 0
        self.topics: dict[str, Topic] = {}
        self.channels: dict[int, str] = {}
        self.places: list[_Place] = []

    def take(self, piece: Piece) -> None:
        """The next piece of the file."""
        record = piece.record
        if record.opcode == MESSAGE:
            self._run.append(record)
            self._run_size += len(record.body)
            if self._run_size >= RUN:
                self.close_run()
            return
        self.close_run()
        if record.opcode == CHUNK:
            self._chunk(piece)
        elif record.opcode in (SCHEMA, CHANNEL):
            guarded(self._path, record, self._declared)

    def _declared(self, record: Record) -> None:
        from mcap import records
        from mcap.data_stream import ReadDataStream

        self._named += 1
        if self._named > MAX_NAMED:
            raise BadRecording(self._path, f"declares more than {MAX_NAMED} channels and schemas")
        stream = ReadDataStream(BytesIO(record.body))
        if record.opcode == SCHEMA:
            schema = records.Schema.read(stream)
            self._schemas[schema.id] = (schema.name, schema.encoding, schema.data.decode("utf-8", "replace"))
            return
        channel = records.Channel.read(stream)
        name, encoding, text = self._schemas.get(channel.schema_id, ("", "", ""))
        readable = encoding == "ros2msg" and channel.message_encoding == "cdr"
        self.channels[channel.id] = channel.topic
        known = self.topics.get(channel.topic)
        if known is None:
            words = (
                channel.message_encoding if encoding in ("", "ros2msg") else f"{channel.message_encoding}/{encoding}"
            )
            self.topics[channel.topic] = Topic(channel.topic, name, text if readable else "", words)
        elif known.definition != (text if readable else ""):
            raise CdrError(f"{channel.topic} has two types, {known.type} and {name}")

    def _chunk(self, piece: Piece) -> None:
        at = ChunkPlace(piece.record.offset, piece.end)
        if piece.indexes and all(channel in self.channels for channel in piece.indexes):
            for channel, entries in piece.indexes.items():
                self._saw(channel, np.frombuffer(entries, dtype="<u8")[::2].astype(np.int64))
            self.places.append(_Place(at, chunk=True, channels=frozenset(piece.indexes)))
        else:
            guarded(self._path, piece.record, lambda one: self._opened(open_chunk(self._path, one), at, chunk=True))

    def close_run(self) -> None:
        """Messages outside chunks end here, if there were any."""
        run, self._run, self._run_size = self._run, [], 0
        if run:
            data = b"".join(RECORD_HEAD.pack(one.opcode, len(one.body)) + one.body for one in run)
            place = ChunkPlace(run[0].offset, run[-1].end)
            guarded(self._path, run[0], lambda _: self._opened(data, place, chunk=False))

    def _opened(self, data: bytes, at: ChunkPlace, *, chunk: bool) -> None:
        found, others = walked(data)
        for opcode, body in others:
            if opcode in (SCHEMA, CHANNEL):
                self._declared(Record(opcode, at.start, body))
        for channel, places in found.items():
            self._saw(channel, places.times)
        self.places.append(_Place(at, chunk=chunk, channels=frozenset(found)))

    def _saw(self, channel: int, times: Int) -> None:
        if channel not in self.channels:
            raise CdrError(f"it has a message of channel {channel}, which is not declared")
        self.topics[self.channels[channel]].saw(times)


def _read(path: Path, file: BinaryIO, place: _Place, wanted: frozenset[int]) -> Iterator[tuple[int, bytes, Places]]:
    """The messages of some channels in one stretch."""
    indexes: dict[int, bytes] = {}
    if place.chunk:
        chunk, *others = records_at(path, file, place.at)
        data = open_chunk(path, chunk)
        indexes = dict(guarded(path, other, message_index) for other in others)
    else:
        file.seek(place.at.start)
        data = file.read(place.at.end - place.at.start)
    found = indexed(data, {channel: raw for channel, raw in indexes.items() if channel in wanted}, whole=False)
    if found is None:
        record = Record(CHUNK, place.at.start, data)
        found = guarded(path, record, lambda one: walked(one.body)[0])
    for channel, places in found.items():
        if channel in wanted:
            yield channel, data, places
