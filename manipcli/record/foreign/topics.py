"""Topics, metadata and attachments of any MCAP file, and the positions of its messages.

One pass verifies the file in the memory of one chunk; messages are read on demand.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.record import schemas
from manipcli.record.decode import Int
from manipcli.record.faults import REPAIRABLE, BadRecording
from manipcli.record.gaps import Intervals
from manipcli.record.read.chunk import Places, chunk_places, open_chunk, walked
from manipcli.record.read.salvage import Salvage, Stretch
from manipcli.record.read.scan import Damage, chunk_at, guarded, readable

if TYPE_CHECKING:
    from mcap.records import Channel, Schema

STATES = (schemas.JOINT_STATE, schemas.TF_MESSAGE, schemas.CONTROLLER_STATE)
"""Types of the topics whose gaps are reported."""


@dataclass(slots=True)
class Topic:
    """One topic.

    Attributes:
        name: `/joint_states`.
        type: `sensor_msgs/msg/JointState`, as in the log; "" if unknown.
        definition: text of the schema; "" unless it is `ros2msg` with CDR messages.
        encoding: message encoding, `cdr`; for other than ROS 2 messages with the schema encoding, `json/jsonschema`.
        qos: profiles of its publishers, as rosbag2 writes them; "" if unknown.
        count: number of messages.
        first, last: log times [ns]; 0 without messages.
        intervals: of its messages.
    """

    name: str
    type: str = ""
    definition: str = ""
    encoding: str = ""
    qos: str = ""
    count: int = 0
    first: int = 0
    last: int = 0
    intervals: Intervals = field(default_factory=Intervals, repr=False)

    @property
    def rate(self) -> float | None:
        """Mean rate [Hz]; None below two messages, or if all have the same time."""
        return None if self.last <= self.first else (self.count - 1) * 1e9 / (self.last - self.first)

    def saw(self, times: Int) -> None:
        """Count messages, not none."""
        self.intervals.add(times)
        low, high = int(times.min()), int(times.max())
        self.first = low if self.count == 0 else min(self.first, low)
        self.last = high if self.count == 0 else max(self.last, high)
        self.count += len(times)


@dataclass(frozen=True, slots=True)
class Attached:
    """An attachment: last part of its name, media type, and size [byte]."""

    name: str
    media_type: str
    size: int


@dataclass(frozen=True, slots=True)
class _Place:
    """A part of the file with messages of some channels: a chunk, or messages outside chunks."""

    start: int
    end: int
    chunk: bool
    channels: frozenset[int]


@dataclass(frozen=True, slots=True)
class LogGap:
    """Log times [ns] between which none of these topics has a message."""

    start: int
    end: int
    topics: tuple[str, ...]


@dataclass(slots=True)
class Topics:
    """Content of a log.

    Attributes:
        path: the file.
        all: topics by name, in the order of their declaration.
        size: size of the file [byte].
        profile, library: profile and name of the writer.
        attachments: attachments in the order of the file.
        metadata: name -> key -> value; later records of a name replace keys of earlier ones.
        lost: what is missing at the end of the file, or None.
        damage: what else cannot be read, one sentence each.
    """

    path: Path
    all: dict[str, Topic] = field(default_factory=dict)
    size: int = 0
    profile: str = ""
    library: str = ""
    attachments: list[Attached] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    lost: str | None = None
    damage: list[str] = field(default_factory=list)
    _channels: dict[int, str] = field(default_factory=dict, repr=False)
    _places: list[_Place] = field(default_factory=list, repr=False)

    @property
    def start(self) -> int:
        """Log time of the first message [ns]."""
        return min((topic.first for topic in self.all.values() if topic.count), default=0)

    @property
    def end(self) -> int:
        """Log time of the last message [ns]."""
        return max((topic.last for topic in self.all.values() if topic.count), default=0)

    @property
    def gaps(self) -> tuple[LogGap, ...]:
        """Times without messages of topics that have the states of robots, and so have messages all the time."""
        found: list[LogGap] = []
        of = [
            (gap, topic.name) for topic in self.all.values() if topic.type in STATES for gap in topic.intervals.gaps()
        ]
        for (start, end), name in sorted(of):
            if found and start < found[-1].end:
                found[-1] = LogGap(start, min(end, found[-1].end), (*found[-1].topics, name))
            else:
                found.append(LogGap(start, end, (name,)))
        return tuple(found)

    @property
    def count(self) -> int:
        """Number of messages."""
        return sum(topic.count for topic in self.all.values())

    @property
    def duration(self) -> float:
        """Time from the first to the last message [s]."""
        return (self.end - self.start) / 1e9

    @property
    def faults(self) -> tuple[str, ...]:
        """Damaged and missing parts, one sentence each."""
        return (*self.damage, *([] if self.lost is None else [self.lost]))

    def messages(self, names: Collection[str]) -> Iterator[tuple[str, bytes, Places]]:
        """The messages of some topics in the order of the file: name, bytes, and positions in the bytes.

        Raises:
            BadRecording: the file changed.
        """
        wanted = {number: name for number, name in self._channels.items() if name in names}
        with readable(self.path), self.path.open("rb") as file:
            for place in self._places:
                if place.channels.isdisjoint(wanted):
                    continue
                if place.chunk:
                    chunk, indexes = chunk_at(self.path, file, place.start)
                    data = open_chunk(self.path, chunk)
                    found = guarded(self.path, chunk, lambda _: chunk_places(data, indexes))  # noqa: B023
                else:
                    file.seek(place.start)
                    data = file.read(place.end - place.start)
                    found = walked(data)[0]
                for number, places in found.items():
                    if number in wanted:
                        yield wanted[number], data, places


def open_topics(path: Path, *, damaged: bool = False) -> Topics:
    """The content of a log, finished or not.

    Args:
        path: an MCAP file.
        damaged: read the undamaged parts of a damaged file instead of raising.

    Raises:
        BadRecording: the file is not an MCAP file, or is damaged.
    """
    from mcap import records

    log = Topics(path)
    salvage = Salvage(path)
    schemas: dict[int, Schema] = {}
    for piece in salvage:
        match piece:
            case records.Header():
                log.profile, log.library = piece.profile, piece.library
            case records.Schema():
                schemas.setdefault(piece.id, piece)
            case records.Channel():
                _declare(log, piece, schemas.get(piece.schema_id))
            case records.Attachment():
                name = piece.name.replace("\\", "/").rpartition("/")[2]
                log.attachments.append(Attached(name, piece.media_type, len(piece.data)))
            case records.Metadata():
                log.metadata.setdefault(piece.name, {}).update(piece.metadata)
            case Stretch():
                log._places.append(_Place(piece.start, piece.end, piece.chunk, frozenset(piece.places)))
                for channel, places in piece.places.items():
                    if channel not in log._channels:
                        log.damage.append(f"messages of channel {channel}, which is not declared")
                        log._channels[channel] = f"(channel {channel})"
                    name = log._channels[channel]
                    log.all.setdefault(name, Topic(name)).saw(places.times)
            case Damage():
                log.damage.append(f"bytes {piece.start} to {piece.end} cannot be read: {piece.what}")
    log.size, log.lost = salvage.scan.size, salvage.scan.lost
    if log.damage and not damaged:
        raise BadRecording(path, log.damage[0], hint=REPAIRABLE)
    return log


def _declare(log: Topics, channel: Channel, schema: Schema | None) -> None:
    """Add a channel; the first one of each id counts."""
    if channel.id in log._channels:
        return
    log._channels[channel.id] = channel.topic
    encoding = channel.message_encoding
    written = schema.encoding if schema is not None else ""
    text = ""
    if schema is not None and (written, encoding) == ("ros2msg", "cdr"):
        text = schema.data.decode("utf-8", "replace")
    name = schema.name if schema is not None else ""
    words = encoding if written in ("", "ros2msg") else f"{encoding}/{written}"
    qos = channel.metadata.get("offered_qos_profiles", "")
    known = log.all.setdefault(channel.topic, Topic(channel.topic, name, text, words, qos))
    if known.definition != text:
        log.damage.append(f"{channel.topic} has two types, {known.type} and {name}")
