"""A clean MCAP file of what can be read of a cut, damaged or unfinished one, and an account of what is lost."""

from __future__ import annotations

import os
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
from manipcli.record.records import PAYLOAD
from manipcli.record.write.block import ChunkContent
from manipcli.record.write.container import LIBRARY, Container

if TYPE_CHECKING:
    from mcap.records import Channel, Schema

SUFFIX = ".repairing"


@dataclass(frozen=True, slots=True)
class Loss:
    """Something that could not be kept.

    Attributes:
        what: it was, as far as one can tell.
        after: [s] log time of the last message before it; None where there is none.
        before: [s] log time of the first message behind it; None where there is none, or where it was no message.
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
    """What became of a file.

    Attributes:
        path, output: the file, and the clean one.
        start, end: [s] log time of the first and the last message that was kept; None where there is none.
        messages, attachments: kept.
        messages_lost: None where nobody knows how many there were.
        losses: what was lost, in the order of the file; empty where nothing is.
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
    """`run.repaired.mcap` beside `run.mcap` or `run.mcap.partial`."""
    name = path.name.removesuffix(PARTIAL)
    return path.parent / f"{name.removesuffix('.mcap')}.repaired.mcap"


def repair(path: Path, output: Path, *, overwrite: bool = False) -> Repaired:
    """Writes all that is sound in `path` into `output`, which says of itself what it lacks; `path` stays as it is.

    Args:
        path: any MCAP file, and what a killed run left.
        output: where the clean file goes.
        overwrite: replace it if it exists; never `path` itself.

    Raises:
        BadRecording: the file is no MCAP file, is being written, or holds nothing that could be kept.
        RecordingRefused: nothing can or may be written there.
        CopyFailed: the disk refused; nothing is left of the new file.
    """
    _refuse_living(path)
    if output.exists() and path.exists() and output.samefile(path):
        raise RecordingRefused(output, "it is the file that is to be repaired", hint="choose another name")
    salvage = Salvage(path)
    pieces = iter(salvage)
    # The first piece is read before anything is written: what is no MCAP file leaves nothing behind.
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
    """
    Raises:
        BadRecording: a run holds the file.
    """
    try:
        fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError:
        return  # the reader says why
    try:
        lock(fd, shared=True)
    except (Taken, OSError):
        raise BadRecording(path, "a run is still writing it", hint="repair it when the run is over") from None
    finally:
        os.close(fd)


@dataclass(slots=True)
class _Copy:
    """The clean file while it grows."""

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
        """One more piece of the file."""
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

    def _declare(self, one: Schema | Channel) -> None:
        """A schema or channel, the first of each number."""
        from mcap import records

        if isinstance(one, records.Schema):
            if one.id not in self._schemas:
                self._schemas[one.id] = one
                self.container.declare([one], [])
        elif one.id not in self._channels and one.schema_id in {0, *self._schemas}:
            self._channels[one.id] = one
            self.container.declare([], [one])

    def _chunk(self, chunk: Stretch) -> None:
        if not chunk.places.keys() <= self._channels.keys():
            # What declared them is damaged; the index may know.
            for one in self.salvage.scan.index.declared:
                self._declare(one)
        known = {channel: places for channel, places in chunk.places.items() if channel in self._channels}
        strangers = sum(len(places.times) for channel, places in chunk.places.items() if channel not in known)
        if strangers:
            self._open.append(f"{strangers} messages of channels whose declaration is lost")
        if not known:
            return
        content = _content(chunk.data, known, whole=not strangers)
        self._settle(content.start_ns)
        self.container.chunk(content)
        self._start = content.start_ns if self._start is None else min(self._start, content.start_ns)
        self._end = content.end_ns if self._end is None else max(self._end, content.end_ns)
        self._messages += sum(len(index) for index in content.indexes.values())

    def _settle(self, next_ns: int | None) -> None:
        """The damage since the last chunk lies before `next_ns`."""
        after = None if self._end is None else self._end / 1e9
        before = None if next_ns is None else next_ns / 1e9
        if self._open:
            self._losses.append(Loss("; ".join(self._open), after, before))
            self._open.clear()

    def finished(self, path: Path, output: Path) -> Repaired:
        """What became of it; says so in the clean file, too."""
        if not self._begun or not (self._messages or self._attachments or self._channels):
            raise BadRecording(path, "holds nothing that could be kept")
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


def _content(data: bytes, places: dict[int, Places], *, whole: bool) -> ChunkContent:
    """The messages at `places`; with `whole` these are all, and the data stays as it is."""
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
