"""The content of any MCAP file short of its messages, and where those are. Knows no robot and no task.

One pass verifies everything in the memory of one chunk; messages are read again when they are asked for.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.record.decode import Int
from manipcli.record.faults import REPAIRABLE, BadRecording
from manipcli.record.read.chunk import Places, chunk_places, open_chunk, walked
from manipcli.record.read.salvage import Salvage, Stretch
from manipcli.record.read.scan import Damage, chunk_at, guarded, readable

if TYPE_CHECKING:
    from mcap.records import Channel, Schema


@dataclass(slots=True)
class Topic:
    """One topic.

    Attributes:
        name: `/joint_states`.
        type: `sensor_msgs/msg/JointState`, as the log calls it; "" where it does not say.
        definition: the text of the schema; "" where it is not `ros2msg`, or messages are not CDR.
        encoding: of the messages, `cdr`; of those that are not ROS 2's with that of the schema, `json/jsonschema`.
        count: messages.
        first, last: log times [ns]; 0 where there is no message.
    """

    name: str
    type: str = ""
    definition: str = ""
    encoding: str = ""
    count: int = 0
    first: int = 0
    last: int = 0

    @property
    def rate(self) -> float | None:
        """[Hz] the mean; None below two messages, or where all have one time."""
        return None if self.last <= self.first else (self.count - 1) * 1e9 / (self.last - self.first)

    def saw(self, times: Int) -> None:
        """Counts messages."""
        low, high = int(times.min()), int(times.max())
        self.first = low if self.count == 0 else min(self.first, low)
        self.last = high if self.count == 0 else max(self.last, high)
        self.count += len(times)


@dataclass(frozen=True, slots=True)
class Attached:
    """An attachment: the last part of its name, its media type, and its size in bytes."""

    name: str
    media_type: str
    size: int


@dataclass(frozen=True, slots=True)
class _Place:
    """A stretch of the file with messages of some channels: a chunk, or messages outside chunks."""

    start: int
    end: int
    chunk: bool
    channels: frozenset[int]


@dataclass(slots=True)
class Topics:
    """A log.

    Attributes:
        path: the file.
        all: topics by name, in the order in which they were declared.
        size: [byte] of the file.
        profile, library: as the writer calls itself.
        attachments: in the order of the file.
        metadata: name -> key -> value; later records of a name replace keys of earlier ones.
        lost: what is missing at the end, or None.
        damage: what else cannot be read, a sentence each.
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
        """[ns] log time of the first message."""
        return min((topic.first for topic in self.all.values() if topic.count), default=0)

    @property
    def end(self) -> int:
        """[ns] log time of the last message."""
        return max((topic.last for topic in self.all.values() if topic.count), default=0)

    @property
    def count(self) -> int:
        """Of all messages."""
        return sum(topic.count for topic in self.all.values())

    @property
    def duration(self) -> float:
        """[s] from the first message to the last."""
        return (self.end - self.start) / 1e9

    @property
    def faults(self) -> tuple[str, ...]:
        """What is damaged or missing."""
        return (*self.damage, *([] if self.lost is None else [self.lost]))

    def messages(self, names: Collection[str]) -> Iterator[tuple[str, bytes, Places]]:
        """The messages of some topics: name, bytes, and where in them they are; in the order of the file.

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
        damaged: where it is damaged, what is sound of it.

    Raises:
        BadRecording: it is no MCAP file, or damaged.
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
                        log.damage.append(f"it has messages of channel {channel}, which is not declared")
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
    """A channel, the first of each number."""
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
    known = log.all.setdefault(channel.topic, Topic(channel.topic, name, text, words))
    if known.definition != text:
        log.damage.append(f"{channel.topic} has two types, {known.type} and {name}")
