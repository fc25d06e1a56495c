"""Messages of one channel to columns of numbers, many messages at once.

All messages of a channel in a chunk normally have one length, and the same bytes where names and counts stand, so one
layout; then each run of doubles is gathered with one numpy index over all messages. Others are taken one by one through
the same code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.read.chunk import Int, Places


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
