"""Numbers of any ROS 2 log over time: every message of a topic through the layout of its type.

Messages that have the same layout are read at once, one numpy index a number; layouts are remembered from chunk to
chunk, so that a channel whose names never change is walked once.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, frozen
from manipcli.record.cdr import CdrError
from manipcli.record.columns import Int, Places, every
from manipcli.record.definition import Message
from manipcli.record.faults import BadRecording
from manipcli.record.fields import Way
from manipcli.record.layout import MANY, MAX_LEAVES, Layout, layout
from manipcli.record.schemas import CONTACTS
from manipcli.record.topics import Topics

MAX_VALUES = 50_000_000
"""Of all series together: 800 MB with their times."""
MAX_WALKED = 50_000_000
"""Values that are passed one by one in messages of which each has a layout of its own; about a minute."""
REMEMBERED = 16
"""Layouts of one topic that are tried before a message is walked."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """A field of a topic whose type is known."""

    topic: str
    message: Message
    way: Way


@dataclass(frozen=True, slots=True)
class Series:
    """One number over time.

    Attributes:
        label: the elements of arrays that it belongs to (`joint_1`, `cup`); "" where there is none.
        times: (T,) [s] since the first message of the log, by log time.
        values: (T,); NaN where it is not there for a while.
        held: each value holds until the next.
    """

    label: str
    times: Array
    values: Array
    held: bool = False


def read_series(
    topics: Topics, wanted: Sequence[Wanted], *, start: float = -np.inf, end: float = np.inf
) -> list[list[Series]]:
    """For each field its series, by the order in which they first appear, or by number.

    Args:
        topics: of the log.
        wanted: what to read, all of it in one pass over the file.
        start, end: [s] only what lies between; a value that holds at `start` begins there.

    Raises:
        BadRecording: a message does not fit its type, or there is more than fits into memory.
    """
    gathered = [_Gathered(one.way, one.message, held=topics.all[one.topic].type == CONTACTS) for one in wanted]
    of: dict[str, list[_Gathered]] = {}
    for one, into in zip(wanted, gathered, strict=True):
        of.setdefault(one.topic, []).append(into)
    total = 0
    for topic, data, kept, seconds in _between(topics, of, start, end):
        for into in of[topic]:
            try:
                total += into.add(data, kept, seconds)
            except CdrError as error:
                raise BadRecording(topics.path, f"{topic}: a message of {into.type} {error}") from error
        if total > MAX_VALUES:
            raise BadRecording(
                topics.path,
                f"there are more than {MAX_VALUES} numbers",
                hint="ask for fewer fields, or for a part of the time with --from and --to",
            )
    return [into.series() for into in gathered]


def _between(
    topics: Topics, names: Collection[str], start: float, end: float
) -> Iterator[tuple[str, bytes, Places, Array]]:
    """The messages from `start` to `end` and their times [s]; of a topic whose messages hold until the next, the last
    before `start` too, as if it were of that time."""
    earlier: dict[str, tuple[float, bytes, Places]] = {}
    for topic, data, places in topics.messages(names):
        seconds = (places.times - topics.start) / 1e9
        inside = np.flatnonzero((seconds >= start) & (seconds <= end))
        before = np.flatnonzero(seconds < start)
        if len(before) and topics.all[topic].type == CONTACTS:
            newest = before[np.argmax(seconds[before])]
            if topic not in earlier or earlier[topic][0] <= seconds[newest]:
                earlier[topic] = (float(seconds[newest]), data, places.at(newest[None]))
        if len(inside):
            if topic in earlier and seconds[inside].min() > start:
                _, old, place = earlier.pop(topic)
                yield topic, old, place, np.array([start])
            yield topic, data, places.at(inside), seconds[inside]
            earlier.pop(topic, None)
    if start <= (topics.end - topics.start) / 1e9:
        for topic, (_, data, place) in earlier.items():
            yield topic, data, place, np.array([start])


class _Gathered:
    """The series of one field on their way."""

    def __init__(self, way: Way, message: Message, *, held: bool) -> None:
        self._way = way
        self._message = message
        self._held = held
        self._layouts: deque[tuple[int, Layout, Int, bytes]] = deque(maxlen=REMEMBERED)
        self._parts: dict[str, list[tuple[Array, Array]]] = {}
        self._seen: list[Array] = []
        self._walked = 0

    @property
    def type(self) -> str:
        return self._message.name

    def add(self, data: bytes, places: Places, seconds: Array) -> int:
        """Messages of one stretch; how many numbers they hold."""
        rest = np.arange(len(seconds))
        added = 0
        if self._held:
            self._seen.append(seconds)
        while len(rest):
            found, alike = self._alike(data, places, rest)
            times = seconds[alike]
            for leaf, values in _values(data, places.starts[alike], found):
                if leaf not in self._parts and len(self._parts) >= MAX_LEAVES:
                    raise CdrError(MANY)
                self._parts.setdefault(leaf, []).append((times, values))
                added += len(values)
            rest = np.setdiff1d(rest, alike, assume_unique=True)
        return added

    def _alike(self, data: bytes, places: Places, rest: Int) -> tuple[Layout, Int]:
        """A layout, and those of the messages `rest` that have it, the first among them."""
        first = int(rest[0])
        start, length = int(places.starts[first]), int(places.lengths[first])
        message = memoryview(data)[start : start + length]
        own = np.frombuffer(message, np.uint8)
        fitting = (one for one in self._layouts if one[0] == length and bytes(own[one[2]]) == one[3])
        found = next(fitting, None)
        if found is None:
            made = layout(self._message, self._way.parts, message)
            self._walked += made.steps
            if self._walked > MAX_WALKED:
                raise CdrError("has other parts each time, and there are too many of them")
            at = np.array(made.guards, dtype=np.int64)
            found = (length, made, at, bytes(own[at]))
            self._layouts.appendleft(found)
        _, known, guards, letters = found
        same = rest[places.lengths[rest] == length]
        if len(guards):
            bytes_of = np.frombuffer(data, np.uint8)
            wanted = np.frombuffer(letters, np.uint8)
            # A few megabytes at a time.
            step = max(1, (1 << 22) // len(guards))
            fits = [
                (bytes_of[places.starts[some][:, None] + guards] == wanted).all(axis=1)
                for some in (same[k : k + step] for k in range(0, len(same), step))
            ]
            same = same[np.concatenate(fits)]
        return known, same

    def series(self) -> list[Series]:
        """What was gathered."""
        labels = list(self._parts)
        if all(label.isdecimal() for label in labels):
            labels.sort(key=int)
        return [self._one(label) for label in labels]

    def _one(self, label: str) -> Series:
        times, values = (np.concatenate(column) for column in zip(*self._parts[label], strict=True))
        order = np.argsort(times, kind="stable")
        times, values = times[order], values[order]
        if self._held:
            # Each message says all that touches: who is not in it touches no more.
            seen = np.unique(np.concatenate(self._seen))
            whole = np.full(len(seen), np.nan)
            whole[np.searchsorted(seen, times)] = values
            times, values = seen, whole
        return Series(label, frozen(times), frozen(values), self._held)


def _values(data: bytes, starts: Int, found: Layout) -> list[tuple[str, Array]]:
    """The numbers of messages that begin at `starts`, each with its label; what has a label twice is numbered."""
    result: list[tuple[str, Array]] = []
    used: dict[str, int] = {}
    for leaf in found.leaves:
        values = _numbers(data, starts + leaf.offset, leaf.code)
        if leaf.time:
            values = values + _numbers(data, starts + leaf.offset + 4, "<u4") / 1e9
        used[leaf.label] = used.get(leaf.label, 0) + 1
        label = leaf.label if used[leaf.label] == 1 else f"{leaf.label} #{used[leaf.label]}"
        result.append((label, values))
    return result


def _numbers(data: bytes, at: Int, code: str) -> Array:
    """(T,) the numbers that begin at these bytes."""
    return every(data, code)[at].astype(np.float64)
