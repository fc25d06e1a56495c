"""Copies of logs: a split log as one MCAP file, a log with a further message."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from manipcli.record.channels import TRANSIENT_LOCAL
from manipcli.record.faults import REPAIRABLE, BadRecording
from manipcli.record.foreign.repair import chunk_content
from manipcli.record.read.chunk import Places, walked
from manipcli.record.read.salvage import Salvage, Stretch
from manipcli.record.read.scan import Damage
from manipcli.record.records import PAYLOAD
from manipcli.record.schemas import schema_text
from manipcli.record.write.container import Container
from manipcli.record.write.rows import message_record

if TYPE_CHECKING:
    from mcap.records import Channel, Schema

_AT = PAYLOAD - 9
"""Bytes from the channel number of a message record to its payload."""
MAX_CHANNELS = 1 << 16


@dataclass(frozen=True, slots=True)
class Added:
    """A message that a copy has besides those of the log: of type `type` at `ns` [ns], transient local."""

    topic: str
    type: str
    ns: int
    data: bytes


def join(parts: Sequence[Path], output: Path, *, added: Added | None = None) -> None:
    """Writes the messages of all parts, part by part, to one file, with attachments and metadata.

    Equal channels of several parts become one. Of an unfinished last part, what is complete is kept. `added` comes
    after the first messages of the log.

    Raises:
        BadRecording: a part is not an MCAP file, is damaged, or is unfinished and not the last.
        RecordingFailed: writing failed.
    """
    container = Container(output, overwrite=True)
    try:
        joined = _Joined(container, added)
        for part in parts:
            joined.add(part, last=part is parts[-1])
        container.finish()
    finally:
        container.close()
        container.partial.unlink(missing_ok=True)


class _Joined:
    """The joined file while it is written: its schemas and channels by their contents."""

    def __init__(self, container: Container, added: Added | None) -> None:
        self._container = container
        self._added = added
        self._begun = False
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, int, str, tuple[tuple[str, str], ...]], int] = {}

    def add(self, path: Path, *, last: bool) -> None:
        from mcap import records

        salvage = Salvage(path)
        schemas, channels = {0: 0}, dict[int, int]()
        for piece in salvage:
            match piece:
                case records.Header():
                    if not self._begun:
                        self._container.begin([], [], profile=piece.profile, library=piece.library)
                    self._begun = True
                case records.Schema():
                    schemas.setdefault(piece.id, self._schema(piece))
                case records.Channel():
                    channels.setdefault(piece.id, self._channel(path, piece, schemas.get(piece.schema_id, 0)))
                case records.Attachment():
                    self._container.attach(piece)
                case records.Metadata():
                    self._container.metadata(piece.name, piece.metadata)
                case Stretch():
                    self._chunk(path, piece, channels)
                    self._add(path)
                case Damage():
                    raise BadRecording(path, f"bytes {piece.start} to {piece.end}: {piece.what}", hint=REPAIRABLE)
        if salvage.scan.lost is not None and not last:
            raise BadRecording(path, f"a part before the last one is incomplete: {salvage.scan.lost}", hint=REPAIRABLE)

    def _add(self, path: Path) -> None:
        """Write the added message, once."""
        from mcap.records import Channel, Schema

        added, self._added = self._added, None
        if added is not None:
            schema = self._schema(Schema(0, schema_text(added.type).encode(), "ros2msg", added.type))
            qos = {"offered_qos_profiles": TRANSIENT_LOCAL}
            channel = self._channel(path, Channel(0, added.topic, "cdr", qos, schema), schema)
            record = message_record(channel, 1, added.ns, added.data)
            self._container.chunk(chunk_content(record, walked(record)[0], whole=True))

    def _schema(self, schema: Schema) -> int:
        from mcap.records import Schema as Record

        key = (schema.name, schema.encoding, schema.data)
        if key not in self._schemas:
            self._schemas[key] = number = len(self._schemas) + 1
            self._container.declare([Record(id=number, name=key[0], encoding=key[1], data=key[2])], [])
        return self._schemas[key]

    def _channel(self, path: Path, channel: Channel, schema: int) -> int:
        from mcap.records import Channel as Record

        key = (channel.topic, schema, channel.message_encoding, tuple(sorted(channel.metadata.items())))
        if key not in self._channels:
            self._channels[key] = number = len(self._channels)
            if number >= MAX_CHANNELS:
                raise BadRecording(path, f"more than {MAX_CHANNELS} channels in all parts")
            record = Record(
                id=number, topic=key[0], schema_id=schema, message_encoding=key[2], metadata=dict(channel.metadata)
            )
            self._container.declare([], [record])
        return self._channels[key]

    def _chunk(self, path: Path, chunk: Stretch, channels: dict[int, int]) -> None:
        """Write a chunk with the channel numbers of the joined file."""
        if unknown := chunk.places.keys() - channels.keys():
            raise BadRecording(path, f"messages of channel {min(unknown)}, which is not declared", hint=REPAIRABLE)
        data = np.frombuffer(chunk.data, dtype=np.uint8).copy()
        found: dict[int, list[Places]] = {}
        for old, places in chunk.places.items():
            new = channels[old]
            data[places.starts - _AT], data[places.starts - _AT + 1] = new & 0xFF, new >> 8
            found.setdefault(new, []).append(places)
        if found:
            together = {new: _together(several) for new, several in found.items()}
            self._container.chunk(chunk_content(data.tobytes(), together, whole=False))


def _together(several: Sequence[Places]) -> Places:
    """The messages of several channels as those of one."""
    times, starts, lengths = (
        np.concatenate(rows) for rows in zip(*((one.times, one.starts, one.lengths) for one in several), strict=True)
    )
    return Places(times, starts, lengths)
