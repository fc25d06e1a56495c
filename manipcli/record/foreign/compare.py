"""Comparison of two logs of any ROS 2 topics, message by message, in the memory of a few chunks.

Messages of a topic with equal log times are pairs. A pair is the same if its bytes are equal or, with a tolerance, if
only numbers differ, and by no more than the tolerance.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from manipcli.record.cdr import CdrError
from manipcli.record.decode import Bytes, Int, rows
from manipcli.record.definition import Message, UnknownDefinition, read_definition
from manipcli.record.foreign.distance import Near, Value, first_difference
from manipcli.record.foreign.topics import Topic, Topics, open_topics
from manipcli.record.read.chunk import Places

MAX_WAITING = 1 << 28
"""Most bytes of messages that wait for their partner; beyond it, the partner counts as absent."""
HEAD = 20
"""Bytes before a message: sequence number, log time, publish time."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A message that differs or is missing in the other log.

    Attributes:
        time: log time [s].
        field: path in the message; in parentheses if it is not a field.
        a, b: value in each log; None without the message.
        index: index of the message within its topic, from 0.
    """

    time: float
    topic: str
    field: str
    a: float | int | str | None
    b: float | int | str | None
    index: int

    @property
    def by(self) -> float | None:
        """b - a for numbers, else None."""
        if isinstance(self.a, str | None) or isinstance(self.b, str | None):
            return None
        return float(self.b - self.a)


@dataclass(slots=True)
class TopicComparison:
    """Comparison of a topic that is in both logs or in one.

    Attributes:
        name, type: name and type of the topic.
        messages: number of messages in each log.
        different: number of pairs that differ.
        only: number of messages without a partner in each log.
        first: the earliest difference.
        why: why its messages cannot be compared; "" if they are.
    """

    name: str
    type: str
    messages: tuple[int, int]
    different: int = 0
    only: list[int] = field(default_factory=lambda: [0, 0])
    first: Difference | None = None
    why: str = ""

    @property
    def same(self) -> bool:
        """Whether both logs have the same messages of the topic."""
        return not self.why and not self.different and not any(self.only)

    def met(self, found: Difference) -> None:
        """Keep the earliest difference."""
        if self.first is None or found.time < self.first.time:
            self.first = found


@dataclass(frozen=True, slots=True)
class Comparison:
    """All topics of two logs, in the order of the first log; `end`: log time of its last message [s]."""

    topics: tuple[TopicComparison, ...]
    end: float

    @property
    def same(self) -> bool:
        """Whether both logs have the same messages."""
        return all(topic.same for topic in self.topics)

    @property
    def first(self) -> Difference | None:
        """The earliest difference of all topics."""
        return min(
            (topic.first for topic in self.topics if topic.first is not None),
            key=lambda difference: difference.time,
            default=None,
        )

    @property
    def messages(self) -> int:
        """Number of messages of the first log."""
        return sum(topic.messages[0] for topic in self.topics)


def compare_logs(
    a: Path,
    b: Path,
    *,
    tolerance: float = 0.0,
    exact: bool = False,
    open_end: bool = False,
    besides: Mapping[str, Collection[str]] | None = None,
) -> Comparison:
    """Compare two logs.

    Args:
        a, b: MCAP files of ROS 2 messages, finished or not.
        tolerance: largest difference of equal numbers, in any unit.
        exact: also compare sequence numbers and publish times.
        open_end: `a` is incomplete; messages of `b` at or after its end are not compared.
        besides: fields by topic that are not compared.

    Raises:
        BadRecording: a file is not an MCAP file, or is damaged.
    """
    logs = (open_topics(a), open_topics(b))
    found = {name: _topic(logs, name) for name in (*logs[0].all, *(n for n in logs[1].all if n not in logs[0].all))}
    comparable = {name: topic for name, topic in found.items() if not topic.why}
    _Merge(logs, comparable, tolerance, exact, end=logs[0].end if open_end else None, besides=besides or {}).run()
    return Comparison(tuple(found.values()), logs[0].end / 1e9)


def compared_with_itself(log: Path) -> Comparison:
    """The comparison of two files with equal bytes: only counts of messages.

    Raises:
        BadRecording: the file is not an MCAP file, or is damaged.
    """
    topics = open_topics(log)
    every = tuple(TopicComparison(topic.name, topic.type, (topic.count, topic.count)) for topic in topics.all.values())
    return Comparison(every, topics.end / 1e9)


def _topic(logs: tuple[Topics, Topics], name: str) -> TopicComparison:
    there = [log.all[name] for log in logs if name in log.all]
    counts = (_count(logs[0], name), _count(logs[1], name))
    topic = TopicComparison(name, there[0].type, counts)
    if len(there) == 2 and (there[0].type, there[0].definition) != (there[1].type, there[1].definition):
        topic.why = f"types differ: {there[0].type} and another {there[1].type}"
    elif there[0].encoding != there[-1].encoding:
        topic.why = f"encodings differ: {there[0].encoding} and {there[1].encoding}"
    return topic


def _count(log: Topics, name: str) -> int:
    return log.all[name].count if name in log.all else 0


@dataclass(slots=True)
class _Block:
    """Waiting messages of a topic; `index`: index of the first within its topic."""

    data: bytes
    places: Places
    index: int

    def __len__(self) -> int:
        return len(self.places.times)

    def take(self, count: int) -> _Block:
        """Remove and return the first `count` messages."""
        places, index = self.places, self.index
        self.places = Places(places.times[count:], places.starts[count:], places.lengths[count:])
        self.index += count
        return _Block(self.data, Places(places.times[:count], places.starts[:count], places.lengths[:count]), index)

    def row(self, k: int, before: int = 0) -> bytes:
        """The k-th message with `before` bytes before it."""
        start = int(self.places.starts[k])
        return self.data[start - before : start + int(self.places.lengths[k])]

    def rows(self, which: Int, length: int, before: int) -> Bytes:
        """(n, before + length) messages of equal length."""
        return rows(self.data, self.places.starts[which] - before, before + length)


class _Side:
    """Reading position in one log."""

    def __init__(self, log: Topics, names: Collection[str]) -> None:
        self._messages: Iterator[tuple[str, bytes, Places]] = log.messages(names)
        self.waiting: dict[str, deque[_Block]] = {name: deque() for name in names}
        self._seen = dict.fromkeys(names, 0)
        self.newest = -1
        self.done = False

    def read(self) -> str | None:
        """Read the next block of messages; returns their topic, or None at the end."""
        name, data, places = next(self._messages, (None, b"", None))
        if name is None or places is None:
            self.done = True
            return None
        if len(places.times):
            self.waiting[name].append(_Block(data, places, self._seen[name]))
            self._seen[name] += len(places.times)
            self.newest = max(self.newest, int(places.times[-1]))
        return name

    @property
    def size(self) -> int:
        """Memory of the waiting chunks [byte]."""
        kept = {id(block.data): len(block.data) for blocks in self.waiting.values() for block in blocks}
        return sum(kept.values())


class _Merge:
    """Reads both logs in parallel and compares pairs."""

    def __init__(
        self,
        logs: tuple[Topics, Topics],
        found: dict[str, TopicComparison],
        tolerance: float,
        exact: bool,
        end: int | None,
        besides: Mapping[str, Collection[str]],
    ) -> None:
        self._found = found
        self._sides = (_Side(logs[0], found), _Side(logs[1], found))
        self._before = HEAD if exact else 0
        self._tolerance = tolerance
        self._end = end
        self._besides = besides
        described = {name: logs[0].all.get(name) or logs[1].all[name] for name in found}
        self._messages = {name: _definition(topic) for name, topic in described.items()}
        self._near = {name: Near(message, tolerance) for name, message in self._messages.items() if message}

    def run(self) -> None:
        left, right = self._sides
        while not (left.done and right.done):
            side, other = (left, right)
            if left.done or (not right.done and right.newest < left.newest):
                side, other = right, left
            name = side.read()
            if name is not None:
                self._meet(name)
            while side.size > MAX_WAITING:
                # The topic with the most waiting messages has waited longest.
                name = max(side.waiting, key=lambda topic: len(side.waiting[topic]))
                self._alone(name, self._sides.index(side), side.waiting[name].popleft())
            if other.done:
                self._let_go(side)
            if side.done:
                self._let_go(other)
        self._let_go(left)
        self._let_go(right)

    def _let_go(self, side: _Side) -> None:
        """Count waiting messages as messages without a partner."""
        for name, blocks in side.waiting.items():
            while blocks:
                self._alone(name, self._sides.index(side), blocks.popleft())

    def _meet(self, name: str) -> None:
        """Compare the waiting messages of a topic."""
        a, b = (side.waiting[name] for side in self._sides)
        while a and b:
            n = min(len(a[0]), len(b[0]))
            ta, tb = a[0].places.times, b[0].places.times
            unlike = np.flatnonzero(ta[:n] != tb[:n])
            alike = int(unlike[0]) if len(unlike) else n
            if alike:
                self._pairs(name, a[0].take(alike), b[0].take(alike))
            elif ta[0] < tb[0]:
                self._alone(name, 0, a[0].take(_leading(ta < tb[0])))
            else:
                self._alone(name, 1, b[0].take(_leading(tb < ta[0])))
            for queue in (a, b):
                if not len(queue[0]):
                    queue.popleft()

    def _pairs(self, name: str, a: _Block, b: _Block) -> None:
        """Compare messages with equal times."""
        topic = self._found[name]
        unlike = [np.flatnonzero(a.places.lengths != b.places.lengths)]
        same = a.places.lengths == b.places.lengths
        for length in np.unique(a.places.lengths[same]).tolist():
            which = np.flatnonzero(same & (a.places.lengths == length))
            step = max(1, (1 << 22) // (length + self._before))
            for some in (which[k : k + step] for k in range(0, len(which), step)):
                both = (a.rows(some, length, self._before), b.rows(some, length, self._before))
                other = np.flatnonzero((both[0] != both[1]).any(axis=1))
                if len(other) and self._tolerance and name in self._near:
                    near = self._near[name].within(both[0][other, self._before :], both[1][other, self._before :])
                    other = other[~near]
                unlike.append(some[other])
        every = np.concatenate(unlike)
        if name in self._besides:
            every = every[[self._first(name, a.row(k), b.row(k)) is not None for k in every.tolist()]]
        if len(every):
            topic.different += len(every)
            first = int(every.min())
            time = int(a.places.times[first])
            if topic.first is None or time / 1e9 < topic.first.time:
                topic.met(self._difference(name, time, a.index + first, a.row(first, HEAD), b.row(first, HEAD)))

    def _difference(self, name: str, ns: int, index: int, a: bytes, b: bytes) -> Difference:
        """The first difference of two messages with their heads."""
        message = self._messages[name]
        found: tuple[str, Value, Value] | None = None
        if message is not None and a[HEAD:] != b[HEAD:]:
            found = self._first(name, a[HEAD:], b[HEAD:])
        if found is None and self._before:
            found = _head_difference(a, b)
        nothing = "(bytes between its fields)" if message is not None else "(its bytes)"
        label, x, y = found or (nothing, "", "")
        return Difference(ns / 1e9, name, label, x, y, index)

    def _first(self, name: str, a: bytes, b: bytes) -> tuple[str, Value, Value] | None:
        """The first field of two messages that differs, and its values."""
        message = self._messages[name]
        if message is None:
            return "(its bytes)", "", ""
        try:
            return first_difference(message, a, b, self._tolerance, self._besides.get(name, ()))
        except CdrError:
            return "(a truncated message)", len(a), len(b)

    def _alone(self, name: str, side: int, block: _Block) -> None:
        """Messages without a partner."""
        times = block.places.times
        if side == 1 and self._end is not None:
            times = times[times < self._end]
        if not len(times):
            return
        topic = self._found[name]
        topic.only[side] += len(times)
        k = int(times.argmin())
        here = "present"
        a, b = (here, None) if side == 0 else (None, here)
        topic.met(Difference(int(times[k]) / 1e9, name, "(the whole message)", a, b, block.index + k))


def _head_difference(a: bytes, b: bytes) -> tuple[str, int, int] | None:
    """The difference in the heads of two messages."""
    for label, part in (("(sequence number)", slice(0, 4)), ("(publish time)", slice(12, HEAD))):
        x, y = (int.from_bytes(head[part], "little") for head in (a, b))
        if x != y:
            return label, x, y
    return None


def _leading(true: npt.NDArray[np.bool_]) -> int:
    """Number of leading true values; at least one."""
    return max(1, len(true) if true.all() else int(np.argmin(true)))


def _definition(topic: Topic) -> Message | None:
    """The message type; None if only bytes can be compared, without a readable ROS 2 definition."""
    if not topic.definition:
        return None
    try:
        return read_definition(topic.type, topic.definition)
    except UnknownDefinition:
        return None
