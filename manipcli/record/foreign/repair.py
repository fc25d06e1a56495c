"""Repair of a truncated, damaged or unfinished MCAP file: a clean copy and a list of losses."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.lock import Taken, lock
from manipcli.record.contents import REPAIR
from manipcli.record.faults import PARTIAL, BadRecording, CopyFailed, RecordingFailed, RecordingRefused
from manipcli.record.read.chunk import Places, walked
from manipcli.record.read.salvage import Salvage, Stretch
from manipcli.record.read.scan import Damage
from manipcli.record.records import LIBRARY, PAYLOAD
from manipcli.record.write.block import ChunkContent
from manipcli.record.write.container import Container

if TYPE_CHECKING:
    from mcap.records import Channel, Schema

SUFFIX = ".repairing"


@dataclass(frozen=True, slots=True)
class Loss:
    """A part that cannot be kept.

    Attributes:
        what: description of the part.
        after: log time of the last message before it [s]; None without one.
        before: log time of the first message after it [s]; None without one, or if the part is not messages.
    """

    what: str
    after: float | None
    before: float | None

    def __str__(self) -> str:
        if self.after is None:
            return self.what if self.before is None else f"before t = {self.before:.3f} s: {self.what}"
        if self.before is None:
            return f"after t = {self.after:.3f} s: {self.what}"
        return f"between t = {self.after:.3f} s and {self.before:.3f} s: {self.what}"


@dataclass(frozen=True, slots=True)
class Repaired:
    """Result of a repair.

    Attributes:
        path, output: the damaged file and the clean copy.
        start, end: log times of the first and the last kept message [s]; None without messages.
        messages, attachments: what is kept.
        messages_lost: number of lost messages; None if unknown.
        losses: losses in the order of the file.
    """

    path: Path
    output: Path
    start: float | None
    end: float | None
    messages: int
    attachments: tuple[str, ...]
    messages_lost: int | None
    losses: tuple[Loss, ...]


def default_output(path: Path) -> Path:
    """`run.repaired.mcap` next to `run.mcap` or `run.mcap.partial`."""
    name = path.name.removesuffix(PARTIAL)
    return path.parent / f"{name.removesuffix('.mcap')}.repaired.mcap"


def repair(path: Path, output: Path, *, overwrite: bool = False) -> Repaired:
    """Write all undamaged parts of `path` to `output`, with the losses in its metadata; `path` is unchanged.

    Args:
        path: any MCAP file, or the partial log of a killed run.
        output: path of the clean copy.
        overwrite: replace `output` if it exists; never `path` itself.

    Raises:
        BadRecording: the file is not an MCAP file, is being written, or has nothing to keep.
        RecordingRefused: `output` cannot or must not be written.
        CopyFailed: writing failed; the incomplete copy is removed.
    """
    _refuse_living(path)
    if output.exists() and path.exists() and output.samefile(path):
        raise RecordingRefused(output, "output and input are the same file", hint="choose another name")
    salvage = Salvage(path)
    pieces = iter(salvage)
    # Read the first piece before writing, so that a file that is not MCAP creates no output.
    first = next(pieces, None)
    container = Container(output, overwrite=overwrite, suffix=SUFFIX)
    try:
        copy = _Copy(salvage, container)
        while first is not None:
            copy.take(first)
            first = next(pieces, None)
        repaired = copy.finished(path, output)
        container.finish()
    except RecordingFailed as failure:
        raise CopyFailed(output, failure.cause, source=path) from failure
    finally:
        if not container.closed or container.partial.exists():
            container.close()
            container.partial.unlink(missing_ok=True)
    return repaired


def _refuse_living(path: Path) -> None:
    """Check that no run is writing the file.

    Raises:
        BadRecording: a run holds the file.
    """
    try:
        fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError:
        return  # the reader reports why
    try:
        lock(fd, shared=True)
    except (Taken, OSError):
        raise BadRecording(path, "a run is still writing this file", hint="repair it after the run") from None
    finally:
        os.close(fd)


@dataclass(slots=True)
class _Copy:
    """The clean copy while it is written."""

    salvage: Salvage
    container: Container
    _begun: bool = False
    _schemas: dict[int, Schema] = field(default_factory=dict)
    _channels: dict[int, Channel] = field(default_factory=dict)
    _attachments: list[str] = field(default_factory=list)
    _losses: list[Loss] = field(default_factory=list)
    _open: list[str] = field(default_factory=list)
    _start: int | None = None
    _end: int | None = None
    _messages: int = 0

    def take(self, piece: object) -> None:
        """Add a piece of the file."""
        from mcap import records

        match piece:
            case records.Header():
                if not self._begun:
                    self._begun = True
                    self.container.begin([], [], profile=piece.profile, library=piece.library)
                return
            case Damage():
                self._open.append(piece.what)
                return
        if not self._begun:
            self._begun = True
            self.container.begin([], [], profile="", library=LIBRARY)
        match piece:
            case records.Schema() | records.Channel():
                self._declare(piece)
            case records.Attachment():
                self.container.attach(piece)
                self._attachments.append(piece.name)
            case records.Metadata():
                self.container.metadata(piece.name, piece.metadata)
            case Stretch():
                self._chunk(piece)

    def _declare(self, record: Schema | Channel) -> None:
        """Add a schema or channel; the first one of each id counts."""
        from mcap import records

        if isinstance(record, records.Schema):
            if record.id not in self._schemas:
                self._schemas[record.id] = record
                self.container.declare([record], [])
        elif record.id not in self._channels and record.schema_id in {0, *self._schemas}:
            self._channels[record.id] = record
            self.container.declare([], [record])

    def _chunk(self, chunk: Stretch) -> None:
        if not chunk.places.keys() <= self._channels.keys():
            # Their declarations are damaged; use those of the index.
            for record in self.salvage.scan.index.declared:
                self._declare(record)
        known = {channel: places for channel, places in chunk.places.items() if channel in self._channels}
        strangers = sum(len(places.times) for channel, places in chunk.places.items() if channel not in known)
        if strangers:
            self._open.append(f"{strangers} messages of channels without a declaration")
        if not known:
            return
        content = chunk_content(chunk.data, known, whole=not strangers)
        self._settle(content.start_ns)
        self.container.chunk(content)
        self._start = content.start_ns if self._start is None else min(self._start, content.start_ns)
        self._end = content.end_ns if self._end is None else max(self._end, content.end_ns)
        self._messages += sum(len(index) for index in content.indexes.values())

    def _settle(self, next_ns: int | None) -> None:
        """Record the damage since the last chunk as losses before `next_ns`."""
        after = None if self._end is None else self._end / 1e9
        before = None if next_ns is None else next_ns / 1e9
        if self._open:
            self._losses.append(Loss("; ".join(self._open), after, before))
            self._open.clear()

    def finished(self, path: Path, output: Path) -> Repaired:
        """The result, which is also written to the metadata of the copy."""
        if not self._begun or not (self._messages or self._attachments or self._channels):
            raise BadRecording(path, "nothing to keep in this file")
        if self.salvage.scan.lost is not None:
            self._open.append(self.salvage.scan.lost)
        self._settle(None)
        total = self.salvage.scan.index.messages
        lost = None if total is None else max(total - self._messages, 0)
        if self.salvage.scan.lost is None and not self._losses:
            lost = 0
        if self._losses:
            what = "; ".join(map(str, self._losses[:8])) + ("; and more" if len(self._losses) > 8 else "")
            values = {"lost": what, "messages_kept": str(self._messages)}
            self.container.metadata(REPAIR, values if lost is None else values | {"messages_lost": str(lost)})
        return Repaired(
            path=path,
            output=output,
            start=None if self._start is None else self._start / 1e9,
            end=None if self._end is None else self._end / 1e9,
            messages=self._messages,
            attachments=tuple(self._attachments),
            messages_lost=lost,
            losses=tuple(self._losses),
        )


def chunk_content(data: bytes, places: Mapping[int, Places], *, whole: bool) -> ChunkContent:
    """The messages at `places`; with `whole` these are all messages, and the data is used unchanged."""
    if not whole:
        spans = sorted(
            (start - PAYLOAD, start + length)
            for found in places.values()
            for start, length in zip(found.starts.tolist(), found.lengths.tolist(), strict=True)
        )
        data = b"".join(data[begin:end] for begin, end in spans)
        places = walked(data)[0]
    indexes = {}
    for channel, found in sorted(places.items()):
        index = np.empty((len(found.times), 2), dtype=np.uint64)
        index[:, 0], index[:, 1] = found.times, found.starts - PAYLOAD
        indexes[channel] = index
    times = np.concatenate([found.times for found in places.values()])
    return ChunkContent(data, int(times.min()), int(times.max()), indexes)
