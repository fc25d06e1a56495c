"""Append-only writer of MCAP files, which stay readable if the run is killed.

Layout: magic, header, schemas, channels, attachments, metadata, chunks each followed by its message indexes, data end,
summary (schemas, channels, statistics, indexes of chunks, attachments, metadata), summary offsets, footer, magic
(https://mcap.dev/spec). The file carries its final name only when it is complete.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.core.lock import Taken, lock
from manipcli.record.faults import PARTIAL, RecordingFailed, RecordingRefused
from manipcli.record.records import LIBRARY, MAGIC, MESSAGE_INDEX
from manipcli.record.write.block import ChunkContent

if TYPE_CHECKING:
    from mcap.records import Attachment, AttachmentIndex, ChunkIndex, McapRecord, MetadataIndex, Schema
    from mcap.records import Channel as ChannelRecord

PROFILE = "ros2"
COMPRESSION_LEVEL = -1
"""zstd level: 25 % faster than level 1 for 1 % more bytes."""
_INDEX_HEAD = struct.Struct("<BQHI")


@dataclass(frozen=True, slots=True)
class Summary:
    """Content of the summary section, collected while writing; `counts`: channel id -> messages."""

    schemas: list[Schema]
    channels: list[ChannelRecord]
    chunks: list[ChunkIndex]
    attachments: list[AttachmentIndex]
    metadata: list[MetadataIndex]
    counts: dict[int, int]


class Container:
    """An MCAP file open for writing at `<path><suffix>`; `finish` renames it to `path`."""

    def __init__(self, path: Path, *, overwrite: bool, suffix: str = PARTIAL) -> None:
        from zstandard import ZstdCompressor

        self.path = path
        self.partial = path.parent / f"{path.name}{suffix}"  # also for a path without a name, such as .
        self._fd = _claim(path, self.partial, overwrite=overwrite)
        self._size = 0
        self._crc = 0
        self._compressor = ZstdCompressor(level=COMPRESSION_LEVEL)
        self._summary = Summary([], [], [], [], [], {})
        self._start_ns = 2**63 - 1
        self._end_ns = 0

    @property
    def closed(self) -> bool:
        """Whether it is finished, closed or failed, so that nothing can be written."""
        return self._fd < 0

    @property
    def time(self) -> float:
        """Time of the last message that is in the file [s]."""
        return self._end_ns / 1e9

    def begin(
        self,
        schemas: Sequence[Schema],
        channels: Sequence[ChannelRecord],
        *,
        profile: str = PROFILE,
        library: str = LIBRARY,
    ) -> None:
        """Write magic, header, schemas and channels."""
        from mcap.records import Header

        self._append(MAGIC + _records([Header(profile=profile, library=library), *schemas, *channels]))
        self._list(schemas, channels)

    def declare(self, schemas: Sequence[Schema], channels: Sequence[ChannelRecord]) -> None:
        """Write schemas and channels, before the first message that needs them."""
        self._append(_records([*schemas, *channels]))
        self._list(schemas, channels)

    def _list(self, schemas: Sequence[Schema], channels: Sequence[ChannelRecord]) -> None:
        """Add to the summary."""
        self._summary.schemas.extend(schemas)
        self._summary.channels.extend(channels)
        self._summary.counts.update({channel.id: 0 for channel in channels})

    def attachment(self, name: str, media_type: str, data: bytes) -> None:
        from mcap.records import Attachment

        self.attach(Attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data))

    def attach(self, record: Attachment) -> None:
        """Write an attachment unchanged."""
        from mcap.records import AttachmentIndex

        offset, length = self._append(_records([record]))
        self._summary.attachments.append(
            AttachmentIndex(
                offset=offset,
                length=length,
                log_time=record.log_time,
                create_time=record.create_time,
                data_size=len(record.data),
                name=record.name,
                media_type=record.media_type,
            )
        )

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        from mcap.records import Metadata, MetadataIndex

        offset, length = self._append(_records([Metadata(name=name, metadata=dict(values))]))
        self._summary.metadata.append(MetadataIndex(offset=offset, length=length, name=name))

    def chunk(self, content: ChunkContent) -> None:
        """Write a compressed chunk and its message indexes."""
        from mcap.records import Chunk, ChunkIndex

        compressed = self._compressor.compress(content.data)
        chunk = _records(
            [
                Chunk(
                    compression="zstd",
                    data=compressed,
                    message_start_time=content.start_ns,
                    message_end_time=content.end_ns,
                    uncompressed_crc=zlib.crc32(content.data),
                    uncompressed_size=len(content.data),
                )
            ]
        )
        parts = [chunk]
        offsets: dict[int, int] = {}
        end = self._size + len(chunk)
        for channel, index in content.indexes.items():
            offsets[channel] = end
            parts += [_INDEX_HEAD.pack(MESSAGE_INDEX, 6 + index.nbytes, channel, index.nbytes), index.tobytes()]
            end += _INDEX_HEAD.size + index.nbytes
        # One write for the chunk and its indexes: with a full disk, both are written or neither.
        start, length = self._append(b"".join(parts))
        self._summary.chunks.append(
            ChunkIndex(
                chunk_length=len(chunk),
                chunk_start_offset=start,
                compression="zstd",
                compressed_size=len(compressed),
                message_end_time=content.end_ns,
                message_index_length=length - len(chunk),
                message_index_offsets=offsets,
                message_start_time=content.start_ns,
                uncompressed_size=len(content.data),
            )
        )
        for channel, index in content.indexes.items():
            self._summary.counts[channel] += len(index)
        self._start_ns = min(self._start_ns, content.start_ns)
        self._end_ns = max(self._end_ns, content.end_ns)

    def finish(self) -> None:
        """Write summary, footer and magic, sync the file, and rename it."""
        from mcap.records import DataEnd

        self._append(_records([DataEnd(data_section_crc=self._crc)]))
        self._append(closing_part(self._summary, self._size, min(self._start_ns, self._end_ns), self._end_ns))
        self._guard(lambda: os.fsync(self._fd))
        self._guard(lambda: self.partial.replace(self.path))
        self.close()

    def close(self) -> None:
        """Close the file without finishing it; can be called repeatedly."""
        fd, self._fd = self._fd, -1
        if fd >= 0:
            os.close(fd)

    def _append(self, data: bytes) -> tuple[int, int]:
        """Append bytes; returns (offset, length). A failed write is undone: the file ends with a complete part."""
        start = self._size
        self._guard(lambda: self._write(data), undo_to=start)
        self._crc = zlib.crc32(data, self._crc)
        self._size = start + len(data)
        return start, len(data)

    def _write(self, data: bytes) -> None:
        view = memoryview(data)
        while view:
            view = view[os.write(self._fd, view) :]

    def _guard(self, operation: Callable[[], object], *, undo_to: int | None = None) -> None:
        if self._fd < 0:
            raise RecordingFailed(self.partial, "the file is closed", time=self.time)
        try:
            operation()
        except OSError as error:
            if undo_to is not None:
                _truncate(self._fd, undo_to)
            self.close()
            raise RecordingFailed(self.partial, error.strerror or str(error), time=self.time) from error


def closing_part(summary: Summary, offset: int, start_ns: int, end_ns: int) -> bytes:
    """Summary section, summary offsets, footer and magic of a file whose summary begins at `offset`."""
    from mcap.opcode import Opcode
    from mcap.records import Footer, Statistics, SummaryOffset

    statistics = Statistics(
        attachment_count=len(summary.attachments),
        channel_count=len(summary.channels),
        channel_message_counts=summary.counts,
        chunk_count=len(summary.chunks),
        message_count=sum(summary.counts.values()),
        message_end_time=end_ns,
        message_start_time=start_ns,
        metadata_count=len(summary.metadata),
        schema_count=len(summary.schemas),
    )
    groups: list[tuple[Opcode, Sequence[McapRecord]]] = [
        (Opcode.SCHEMA, summary.schemas),
        (Opcode.CHANNEL, summary.channels),
        (Opcode.STATISTICS, [statistics]),
        (Opcode.CHUNK_INDEX, summary.chunks),
        (Opcode.ATTACHMENT_INDEX, summary.attachments),
        (Opcode.METADATA_INDEX, summary.metadata),
    ]
    body = b""
    places = []
    for opcode, records in groups:
        group = _records(records)
        if group:
            places.append(SummaryOffset(opcode, group_start=offset + len(body), group_length=len(group)))
        body += group
    summary_offset_start = offset + len(body)
    body += _records(places)
    # The checksum covers the summary and the footer up to the checksum itself: its last four bytes.
    footer = _records([Footer(summary_start=offset, summary_offset_start=summary_offset_start, summary_crc=0)])
    crc = zlib.crc32(body + footer[:-4])
    return body + footer[:-4] + crc.to_bytes(4, "little") + MAGIC


def _records(records: Sequence[McapRecord]) -> bytes:
    from mcap.data_stream import RecordBuilder

    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    # The builder of the library has no types.
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data


def _truncate(fd: int, size: int) -> None:
    try:
        os.ftruncate(fd, size)
    except OSError:
        # The disk already failed; readers of partial files accept a truncated end.
        return


def _claim(path: Path, partial: Path, *, overwrite: bool) -> int:
    """Open `partial` exclusively; nothing is written before all checks pass."""
    if path.is_dir():
        raise RecordingRefused(path, "the path is a directory", hint="use a file name, such as run.mcap")
    if path.exists() and not path.is_file():
        raise RecordingRefused(path, "the path is not a regular file", hint="choose another name; - is stdout")
    if os.path.lexists(path) and not overwrite:
        raise RecordingRefused(path, "the file exists", hint="choose another name, or pass --force to replace it")
    flags = os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | (0 if overwrite else os.O_EXCL)
    try:
        partial.parent.mkdir(parents=True, exist_ok=True)
        fd = os.open(partial, flags, 0o666)
    except FileExistsError:
        raise RecordingRefused(
            path,
            f"{partial.name} exists: another run is writing it, or was killed",
            hint="rename it, delete it, or pass --force to replace it",
        ) from None
    except OSError as error:
        where = "" if path.parent.is_dir() else f"folder {path.parent}: "
        raise RecordingRefused(path, f"{where}{error.strerror or error}") from error
    try:
        lock(fd)
        os.ftruncate(fd, 0)
    except Taken:
        os.close(fd)
        raise RecordingRefused(path, f"another run is writing {partial.name}") from None
    except OSError as error:
        os.close(fd)
        raise RecordingRefused(path, error.strerror or str(error)) from error
    return fd
