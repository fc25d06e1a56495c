"""Two logs of any ROS 2 topics, message by message, in the memory of a few chunks.

Messages of a topic are pairs where their log times are the same; what has no partner is there once only. A message is
the same when its bytes are, or, with a tolerance, when nothing but numbers differs and those by no more than that.
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
"""[byte] of messages that wait for their partner. One that did not come by then counts as absent."""
HEAD = 20
"""[byte] before a message: sequence number, log time, publish time."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A message that is not the same, or not there, in the other log.

    Attributes:
        time: [s] log time.
        field: path in the message; what is not a field stands in brackets.
        a, b: its value in each log; None where there is no such message.
        index: number of the message within its topic in the log that has it, from 0.
    """

    time: float
    topic: str
    field: str
    a: float | int | str | None
    b: float | int | str | None
    index: int

    @property
    def by(self) -> float | None:
        """b - a, of numbers."""
        if isinstance(self.a, str | None) or isinstance(self.b, str | None):
            return None
        return float(self.b - self.a)


@dataclass(slots=True)
class TopicComparison:
    """One topic of both logs, or of one of them.

    Attributes:
        name, type: of it.
        messages: in each log.
        different: pairs that are not the same.
        only: messages of each log without a partner.
        first: the earliest of all that.
        why: why its messages cannot be compared; "" where they were.
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
        """Whether both logs have the same messages of it."""
        return not self.why and not self.different and not any(self.only)

    def met(self, found: Difference) -> None:
        """Keeps the earliest."""
        if self.first is None or found.time < self.first.time:
            self.first = found


@dataclass(frozen=True, slots=True)
class Comparison:
    """All topics of two logs, in the order of the first; `end` [s]: log time of its last message."""

    topics: tuple[TopicComparison, ...]
    end: float

    @property
    def same(self) -> bool:
        """Whether both have the same messages."""
        return all(topic.same for topic in self.topics)

    @property
    def first(self) -> Difference | None:
        """The earliest difference of all topics."""
        return min((one.first for one in self.topics if one.first is not None), key=lambda one: one.time, default=None)

    @property
    def messages(self) -> int:
        """Of the first log."""
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
        tolerance: numbers in messages that differ by no more are the same, whatever their unit.
        exact: sequence numbers and publish times count, too.
        open_end: `a` ends too early: what `b` has at its end and later is not missing in it.
        besides: by topic, fields that may differ.

    Raises:
        BadRecording: one is no MCAP file, or damaged.
    """
    logs = (open_topics(a), open_topics(b))
    found = {name: _topic(logs, name) for name in (*logs[0].all, *(n for n in logs[1].all if n not in logs[0].all))}
    comparable = {name: one for name, one in found.items() if not one.why}
    _Merge(logs, comparable, tolerance, exact, end=logs[0].end if open_end else None, besides=besides or {}).run()
    return Comparison(tuple(found.values()), logs[0].end / 1e9)


def compared_with_itself(log: Path) -> Comparison:
    """Of two files with the same bytes: their messages counted, without looking at them one by one.

    Raises:
        BadRecording: it is no MCAP file, or damaged.
    """
    topics = open_topics(log)
    every = tuple(TopicComparison(one.name, one.type, (one.count, one.count)) for one in topics.all.values())
    return Comparison(every, topics.end / 1e9)


def _topic(logs: tuple[Topics, Topics], name: str) -> TopicComparison:
    there = [log.all[name] for log in logs if name in log.all]
    counts = (_count(logs[0], name), _count(logs[1], name))
    one = TopicComparison(name, there[0].type, counts)
    if len(there) == 2 and (there[0].type, there[0].definition) != (there[1].type, there[1].definition):
        one.why = f"its type is {there[0].type} in one log and another {there[1].type} in the other"
    elif there[0].encoding != there[-1].encoding:
        one.why = f"it is written as {there[0].encoding} in one log and as {there[1].encoding} in the other"
    return one


def _count(log: Topics, name: str) -> int:
    return log.all[name].count if name in log.all else 0


@dataclass(slots=True)
class _Block:
    """Messages of one topic that wait; `index`: of the first within its topic."""

    data: bytes
    places: Places
    index: int

    def __len__(self) -> int:
        return len(self.places.times)

    def take(self, count: int) -> _Block:
        """The first `count`, which it lets go of."""
        places, index = self.places, self.index
        self.places = Places(places.times[count:], places.starts[count:], places.lengths[count:])
        self.index += count
        return _Block(self.data, Places(places.times[:count], places.starts[:count], places.lengths[:count]), index)

    def row(self, k: int, before: int = 0) -> bytes:
        """Message `k`, and so many bytes before it."""
        start = int(self.places.starts[k])
        return self.data[start - before : start + int(self.places.lengths[k])]

    def rows(self, which: Int, length: int, before: int) -> Bytes:
        """(n, before + length) messages of one length."""
        return rows(self.data, self.places.starts[which] - before, before + length)


class _Side:
    """One log on its way through the comparison."""

    def __init__(self, log: Topics, names: Collection[str]) -> None:
        self._messages: Iterator[tuple[str, bytes, Places]] = log.messages(names)
        self.waiting: dict[str, deque[_Block]] = {name: deque() for name in names}
        self._seen = dict.fromkeys(names, 0)
        self.newest = -1
        self.done = False

    def read(self) -> str | None:
        """The next stretch of messages; their topic, or None at the end."""
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
        """[byte] that what waits keeps in memory: whole chunks."""
        kept = {id(block.data): len(block.data) for blocks in self.waiting.values() for block in blocks}
        return sum(kept.values())


class _Merge:
    """Both logs at once, whichever is behind goes on."""

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
                # It has waited longest where most wait.
                name = max(side.waiting, key=lambda one: len(side.waiting[one]))
                self._alone(name, self._sides.index(side), side.waiting[name].popleft())
            if other.done:
                self._let_go(side)
            if side.done:
                self._let_go(other)
        self._let_go(left)
        self._let_go(right)

    def _let_go(self, side: _Side) -> None:
        """What waits has no partner any more."""
        for name, blocks in side.waiting.items():
            while blocks:
                self._alone(name, self._sides.index(side), blocks.popleft())

    def _meet(self, name: str) -> None:
        """Pairs up what both have of a topic."""
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
        """Messages of the same times."""
        one = self._found[name]
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
            one.different += len(every)
            first = int(every.min())
            time = int(a.places.times[first])
            if one.first is None or time / 1e9 < one.first.time:
                one.met(self._told(name, time, a.index + first, a.row(first, HEAD), b.row(first, HEAD)))

    def _told(self, name: str, ns: int, index: int, a: bytes, b: bytes) -> Difference:
        """What of two messages differs first; both with their heads."""
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
            return "(a message that is cut)", len(a), len(b)

    def _alone(self, name: str, side: int, block: _Block) -> None:
        """Messages without a partner."""
        times = block.places.times
        if side == 1 and self._end is not None:
            times = times[times < self._end]
        if not len(times):
            return
        one = self._found[name]
        one.only[side] += len(times)
        k = int(times.argmin())
        here = "there is one"
        a, b = (here, None) if side == 0 else (None, here)
        one.met(Difference(int(times[k]) / 1e9, name, "(the whole message)", a, b, block.index + k))


def _head_difference(a: bytes, b: bytes) -> tuple[str, int, int] | None:
    """What differs before two messages."""
    for label, part in (("(sequence number)", slice(0, 4)), ("(publish time)", slice(12, HEAD))):
        x, y = (int.from_bytes(head[part], "little") for head in (a, b))
        if x != y:
            return label, x, y
    return None


def _leading(true: npt.NDArray[np.bool_]) -> int:
    """How many are true before the first that is not; one at least."""
    return max(1, len(true) if true.all() else int(np.argmin(true)))


def _definition(topic: Topic) -> Message | None:
    """None where only bytes can be compared: of no ROS 2 message, or of one that nobody describes."""
    if not topic.definition:
        return None
    try:
        return read_definition(topic.type, topic.definition)
    except UnknownDefinition:
        return None
