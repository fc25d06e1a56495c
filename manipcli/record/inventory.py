"""What an MCAP file holds, whoever wrote it and however it ended: topics, attachments, metadata, damage."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from manipcli.record.salvage import Damage, OpenChunk, Salvage


@dataclass(frozen=True, slots=True)
class TopicCount:
    """One channel.

    Attributes:
        name: of the topic.
        type: of its messages; empty where the file does not say.
        encoding: of its messages; `cdr` is what ROS 2 writes.
        messages: how many.
        first, last: [s] log time of the first and the last; None where there is none.
    """

    name: str
    type: str
    encoding: str
    messages: int
    first: float | None
    last: float | None

    @property
    def rate(self) -> float | None:
        """[Hz] the mean; None below two messages, or where all are of one time."""
        if self.first is None or self.last is None or self.last <= self.first:
            return None
        return (self.messages - 1) / (self.last - self.first)


@dataclass(frozen=True, slots=True)
class Attached:
    """An attachment: the last part of its name, its media type, and its size in bytes."""

    name: str
    media_type: str
    size: int


@dataclass(frozen=True, slots=True)
class Inventory:
    """All that is in a file, short of the messages.

    Attributes:
        size: [byte] of the file.
        profile, library: as the writer calls itself.
        topics: by name.
        metadata: name -> key -> value; later records of a name replace keys of earlier ones.
        start, end: [s] log time of the first and the last message; None where there is none.
        faults: what is damaged or missing, a sentence each.
    """

    path: Path
    size: int
    profile: str
    library: str
    topics: tuple[TopicCount, ...]
    attachments: tuple[Attached, ...]
    metadata: dict[str, dict[str, str]]
    start: float | None
    end: float | None
    faults: tuple[str, ...]

    @property
    def duration(self) -> float:
        """[s] from the first message to the last."""
        return 0.0 if self.start is None or self.end is None else self.end - self.start


def inventory(path: Path) -> Inventory:
    """Goes over the whole file once, in the memory of one chunk.

    Raises:
        BadRecording: the file is no MCAP file, or cannot be read.
    """
    from mcap import records

    salvage = Salvage(path)
    profile = library = ""
    types: dict[int, str] = {}
    channels: dict[int, tuple[str, str, str]] = {}
    counts: dict[int, int] = {}
    spans: dict[int, tuple[int, int]] = {}
    attachments: list[Attached] = []
    metadata: dict[str, dict[str, str]] = {}
    faults: list[str] = []
    for piece in salvage:
        match piece:
            case records.Header():
                profile, library = piece.profile, piece.library
            case records.Schema():
                types.setdefault(piece.id, piece.name)
            case records.Channel():
                row = (piece.topic, types.get(piece.schema_id, ""), piece.message_encoding)
                channels.setdefault(piece.id, row)
            case records.Attachment():
                name = piece.name.replace("\\", "/").rpartition("/")[2]
                attachments.append(Attached(name, piece.media_type, len(piece.data)))
            case records.Metadata():
                metadata.setdefault(piece.name, {}).update(piece.metadata)
            case OpenChunk():
                for channel, places in piece.places.items():
                    first, last = int(places.times.min()), int(places.times.max())
                    known = spans.get(channel, (first, last))
                    spans[channel] = min(first, known[0]), max(last, known[1])
                    counts[channel] = counts.get(channel, 0) + len(places.times)
            case Damage():
                faults.append(f"bytes {piece.start} to {piece.end} cannot be read: {piece.what}")
    if salvage.end is not None:
        faults.append(salvage.end)
    topics = []
    for channel in sorted({*channels, *counts}, key=lambda one: channels.get(one, (f"(channel {one})", "", ""))):
        name, kind, encoding = channels.get(channel, (f"(channel {channel})", "", ""))
        span = spans.get(channel)
        first_s, last_s = (None, None) if span is None else (span[0] / 1e9, span[1] / 1e9)
        topics.append(TopicCount(name, kind, encoding, counts.get(channel, 0), first_s, last_s))
    return Inventory(
        path=path,
        size=salvage.size,
        profile=profile,
        library=library,
        topics=tuple(topics),
        attachments=tuple(attachments),
        metadata=metadata,
        start=min(first for first, _ in spans.values()) / 1e9 if spans else None,
        end=max(last for _, last in spans.values()) / 1e9 if spans else None,
        faults=tuple(faults),
    )
