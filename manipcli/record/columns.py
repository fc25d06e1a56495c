"""Messages to columns of numbers: where messages stand in a chunk, and the numbers of all of them at once.

All messages of a channel in a chunk normally have one length, and the same bytes where names and counts stand, so one
layout; then each run of doubles is gathered with one numpy index over all messages. Others are taken one by one through
the same code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.rows import MESSAGE_HEAD, MESSAGE_OPCODE
from manipcli.record.scan import RECORD_HEAD

Int = npt.NDArray[np.int64]
_MAX_OTHERS = 8192
"""Schemas and channels in a chunk."""
PAYLOAD = MESSAGE_HEAD.size
"""From the beginning of a message record to its CDR bytes."""


@dataclass(frozen=True, slots=True)
class Places:
    """The messages of one channel in a chunk, in the order of the file: log times [ns], payload offsets and lengths."""

    times: Int
    starts: Int
    lengths: Int

    def at(self, which: Int) -> Places:
        """Some of them."""
        return Places(self.times[which], self.starts[which], self.lengths[which])


def indexed(data: bytes, indexes: Mapping[int, bytes], *, whole: bool = True) -> dict[int, Places] | None:
    """Messages by channel from a chunk's message indexes (channel -> pairs of log time and offset).

    None when a message is not where they say or, with `whole`, unless they account for every byte of the chunk.
    """
    found: dict[int, Places] = {}
    for channel, raw in indexes.items():
        places = _located(data, channel, raw)
        if places is None:
            return None
        if len(places.times):
            found[channel] = places
    if not found:
        return None
    if not whole:
        return found
    begins = np.sort(np.concatenate([places.starts for places in found.values()])) - PAYLOAD
    stops = np.sort(np.concatenate([places.starts + places.lengths for places in found.values()]))
    covered = begins[0] == 0 and stops[-1] == len(data) and np.array_equal(begins[1:], stops[:-1])
    return found if covered else None


def _located(data: bytes, channel: int, raw: bytes) -> Places | None:
    """The messages of one channel from its message index; None when one of them is not there."""
    size = len(data)
    entries = np.frombuffer(raw, dtype="<u8").reshape(-1, 2)
    if len(entries) and (size < PAYLOAD or entries[:, 1].max() > size - PAYLOAD):
        return None
    at = entries[:, 1].astype(np.int64)
    lengths = every(data, "<u8")[at + 1]
    fits = (
        (np.frombuffer(data, dtype=np.uint8)[at] == MESSAGE_OPCODE)
        & (lengths >= PAYLOAD - 9)
        & (lengths <= size)
        & (every(data, "<u2")[at + 9] == channel)
        & (every(data, "<u8")[at + 15] == entries[:, 0])
    )
    if not fits.all():
        return None
    return Places(entries[:, 0].astype(np.int64), at + PAYLOAD, lengths.astype(np.int64) - (PAYLOAD - 9))


def walked(data: bytes) -> tuple[dict[int, Places], list[tuple[int, bytes]]]:
    """Messages by channel, found by walking over the records; and the records of other kinds (opcode, body).

    Raises:
        CdrError: a record does not fit into the chunk, or there are too many that are no messages.
    """
    rows: dict[int, list[tuple[int, int, int]]] = {}
    others: list[tuple[int, bytes]] = []
    offset = 0
    while offset < len(data):
        if offset + 9 > len(data):
            raise CdrError("ends too early")
        opcode, length = RECORD_HEAD.unpack_from(data, offset)
        end = offset + 9 + length
        if end > len(data) or (opcode == MESSAGE_OPCODE and length < PAYLOAD - 9):
            raise CdrError("ends too early")
        if opcode == MESSAGE_OPCODE:
            _, _, channel, _, time, _ = MESSAGE_HEAD.unpack_from(data, offset)
            rows.setdefault(channel, []).append((min(time, 2**63 - 1), offset + PAYLOAD, length - (PAYLOAD - 9)))
        elif opcode == 0 or len(others) == _MAX_OTHERS:
            raise CdrError("holds too much that is no message")
        else:
            others.append((opcode, data[offset + 9 : end]))
        offset = end
    found = {}
    for channel, entries in rows.items():
        table = np.array(entries, dtype=np.int64)
        found[channel] = Places(table[:, 0], table[:, 1], table[:, 2])
    return found, others


def every(data: bytes, code: str) -> npt.NDArray[np.uint64]:
    """The number that begins at each byte of `data`, as a view."""
    kind = np.dtype(code)
    return np.ndarray((max(len(data) - kind.itemsize + 1, 0),), dtype=kind, buffer=data, strides=(1,))


@dataclass(frozen=True, slots=True)
class NamedRuns:
    """What a message holds: its names, and (offset, count) of its runs of doubles."""

    names: tuple[str, ...]
    runs: tuple[tuple[int, int], ...]


class Columns:
    """The numbers of one channel on their way from chunks to spans.

    Args:
        topic: what errors call it.
        parse: a message to what it holds.
        names: of the joints or bodies that every message must hold, in this order.
        widths: of the runs of doubles that every message must hold.
    """

    def __init__(
        self, topic: str, parse: Callable[[CdrReader], NamedRuns], names: tuple[str, ...], widths: tuple[int, ...]
    ) -> None:
        self._topic = topic
        self._parse = parse
        self._names = names
        self._widths = widths
        self._newest = -1
        self._parts: list[tuple[Int, list[Array]]] = []

    def __len__(self) -> int:
        """Messages that were added and not yet taken."""
        return sum(len(times) for times, _ in self._parts)

    def add(self, data: bytes, places: Places) -> None:
        """The channel's messages of one chunk.

        Raises:
            CdrError: a message is cut, holds other things than it should, or is older than the one before it.
        """
        times = np.concatenate(([self._newest], places.times))
        back = np.flatnonzero(np.diff(times) <= 0)
        if len(back):
            raise CdrError(f"time runs backwards in {self._topic} after t = {times[back[0]] / 1e9:.3f} s")
        self._newest = int(times[-1])
        for part, holds in self._alike(data, places):
            if holds.names != self._names:
                raise CdrError(f"{self._topic} names other joints or bodies than the metadata")
            if tuple(count for _, count in holds.runs) != self._widths:
                raise CdrError(f"{self._topic} has another number of values than of names")
            runs = [_gather(data, part.starts + offset, count) for offset, count in holds.runs]
            self._parts.append((part.times, runs))

    def take(self, count: int) -> tuple[Int, list[Array]]:
        """The first `count` messages: log times [ns], and each run (count, width). The columns let go of them."""
        if len(self._parts) != 1:
            times = np.concatenate([np.zeros(0, dtype=np.int64), *(times for times, _ in self._parts)])
            empty = [np.zeros((0, width)) for width in self._widths]
            runs = [np.concatenate([none, *(runs[k] for _, runs in self._parts)]) for k, none in enumerate(empty)]
            self._parts = [(times, runs)]
        times, runs = self._parts.pop()
        if count < len(times):
            self._parts = [(times[count:], [run[count:] for run in runs])]
        return times[:count], [run[:count] for run in runs]

    def _alike(self, data: bytes, places: Places) -> Iterator[tuple[Places, NamedRuns]]:
        """The messages in groups of one layout each."""
        reader = _Decided(_message(data, places, 0))
        first = self._parse(reader)
        if (places.lengths == places.lengths[0]).all() and all(
            _equal(data, places.starts + start, end - start) for start, end in reader.decided
        ):
            yield places, first
            return
        for k in range(len(places.times)):
            one = Places(places.times[k : k + 1], places.starts[k : k + 1], places.lengths[k : k + 1])
            yield one, self._parse(CdrReader(_message(data, places, k)))


class _Decided(CdrReader):
    """Keeps in mind where what decides the layout stands, counts and texts: [begin, end) each, few and long."""

    def __init__(self, data: memoryview) -> None:
        super().__init__(data)
        self.decided: list[tuple[int, int]] = []

    def u32(self) -> int:
        value = super().u32()
        self._keep(self.offset - 4)
        return value

    def text(self) -> str:
        value = super().text()
        self._keep(self.decided[-1][1])  # where its length ends
        return value

    def _keep(self, begin: int) -> None:
        if self.decided and begin - self.decided[-1][1] < 4:  # nothing between them but what aligns
            begin = self.decided.pop()[0]
        self.decided.append((begin, self.offset))


def _message(data: bytes, places: Places, k: int) -> memoryview:
    start = int(places.starts[k])
    return memoryview(data)[start : start + int(places.lengths[k])]


def _rows(data: bytes, starts: Int, size: int) -> npt.NDArray[np.void]:
    """(T) rows of `size` bytes, at least one, that begin at `starts`."""
    kind = np.dtype((np.void, size))
    return np.ndarray((len(data) - size + 1,), dtype=kind, buffer=data, strides=(1,))[starts]


def _equal(data: bytes, starts: Int, size: int) -> bool:
    """Whether as many bytes are the same at all of `starts`."""
    rows = _rows(data, starts, size).view(np.uint8).reshape(len(starts), size)
    return bool((rows == rows[0]).all())


def _gather(data: bytes, starts: Int, count: int) -> Array:
    """(T, count) doubles that begin at `starts`."""
    if count == 0:
        return np.zeros((len(starts), 0))
    return _rows(data, starts, 8 * count).view("<f8").reshape(len(starts), count)


def singly(data: bytes, places: Places) -> Iterator[tuple[int, CdrReader]]:
    """(log time [ns], reader) of each message."""
    view = memoryview(data)
    for ns, start, length in zip(places.times.tolist(), places.starts.tolist(), places.lengths.tolist(), strict=True):
        yield ns, CdrReader(view[start : start + length])


def sequences(data: bytes, places: Places) -> Int:
    """The sequence number of each message."""
    return every(data, "<u4")[places.starts - PAYLOAD + 11].astype(np.int64)


def joint_state_runs(reader: CdrReader) -> NamedRuns:
    """sensor_msgs/JointState: position, velocity, effort."""
    reader.header()
    names = reader.texts()
    return NamedRuns(names, tuple(reader.doubles() for _ in range(3)))


def body_runs(bodies: frozenset[str], world: str) -> Callable[[CdrReader], NamedRuns]:
    """tf2_msgs/TFMessage: x y z and quaternion xyzw of every one of `bodies` in the world."""

    def parse(reader: CdrReader) -> NamedRuns:
        names, runs = [], []
        for _ in range(reader.count(64)):
            parent, child = reader.header(), reader.text()
            offset = reader.skip(7 * 8, 8)
            if parent == world and child in bodies:
                names.append(child)
                runs.append((offset, 7))
        return NamedRuns(tuple(names), tuple(runs))

    return parse


def controller_state_runs(reader: CdrReader) -> NamedRuns:
    """JointTrajectoryControllerState: reference position and velocity, feedback position, output."""
    reader.header()
    names = reader.texts()
    points = []
    for _ in range(4):
        points.append([reader.doubles() for _ in range(4)])
        reader.skip(8, 4)  # its time
    reference, feedback, _, output = points
    command = next((run for run in output if run[1]), output[0])
    return NamedRuns(names, (reference[0], reference[1], feedback[0], command))
