"""Numbers of any ROS 2 log over time: every message of a topic by the definition of its type.

Messages that have the same layout are read together, with one numpy index per number.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, frozen
from manipcli.record.cdr import CdrError
from manipcli.record.decode import Int, Layouts, Run, runs
from manipcli.record.definition import Message
from manipcli.record.faults import BadRecording
from manipcli.record.foreign.fields import Key, Way
from manipcli.record.foreign.topics import Topics
from manipcli.record.read.chunk import Places, every
from manipcli.record.schemas import CONTACTS

MAX_VALUES = 50_000_000
"""Of all series together: 800 MB with their times."""
MAX_DECODED = 10_000_000
"""Values of messages that each have a layout of their own; about a minute."""
MAX_LEAVES = 2000
"""Wanted numbers in one message."""
MANY = f"has more than {MAX_LEAVES} numbers there; say which ones in brackets"


@dataclass(frozen=True, slots=True)
class Wanted:
    """A field of a topic whose type is known."""

    topic: str
    message: Message
    way: Way


@dataclass(frozen=True, slots=True)
class Leaf:
    """A wanted number: the names of the elements it is in, its first byte in the message, and its code."""

    label: str
    offset: int
    code: str


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
    """The series of one field, from stretch to stretch of the log."""

    def __init__(self, way: Way, message: Message, *, held: bool) -> None:
        self._way = way
        self._message = message
        self._held = held
        self._layouts = Layouts(self._leaves)
        self._parts: dict[str, list[tuple[Array, Array]]] = {}
        self._seen: list[Array] = []
        self._decoded = 0

    @property
    def type(self) -> str:
        return self._message.name

    def add(self, data: bytes, places: Places, seconds: Array) -> int:
        """Messages of one stretch; how many numbers they hold."""
        added = 0
        if self._held:
            self._seen.append(seconds)
        for leaves, alike in self._layouts.groups(data, places.starts, places.lengths):
            for leaf in leaves:
                values = _numbers(data, places.starts[alike] + leaf.offset, leaf.code)
                if self._way.is_time:
                    values = values + _numbers(data, places.starts[alike] + leaf.offset + 4, "<u4") / 1e9
                if leaf.label not in self._parts and len(self._parts) >= MAX_LEAVES:
                    raise CdrError(MANY)
                self._parts.setdefault(leaf.label, []).append((seconds[alike], values))
                added += len(values)
        return added

    def _leaves(self, message: memoryview) -> tuple[tuple[Leaf, ...], list[tuple[int, int]]]:
        found = runs(self._message, message)
        self._decoded += len(found)
        if self._decoded > MAX_DECODED:
            raise CdrError("has other parts each time, and there are too many of them")
        fields = tuple(part.name for part in self._way.parts)
        names = [run for run in found if not run.code and _names(run.fields, fields)]
        # Lengths decide where things are, and texts on the way to the number which element it is in.
        guards = [(run.begin, run.begin + 4) for run in found if run.code in ("", "#")]
        guards += [(run.offset, run.end) for run in names]
        return leaves(found, self._way), guards

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


def _names(text: tuple[str, ...], fields: tuple[str, ...]) -> bool:
    """Whether a text is in one of the messages on the way to a number, where it may name an element."""
    return text[:-1] == fields[: len(text) - 1] and len(text) <= len(fields)


def leaves(found: Sequence[Run], way: Way) -> tuple[Leaf, ...]:
    """The wanted numbers of a message; a label that occurs again gets a number.

    Raises:
        CdrError: they are too many.
    """
    fields = tuple(part.name for part in way.parts) + (("sec",) if way.is_time else ())
    result: list[Leaf] = []
    used: dict[str, int] = {}
    for run in found:
        if run.code in ("", "#") or len(run.steps) != len(fields) or run.fields != fields:
            continue
        above = [(one, part.key) for (_, one), part in zip(run.steps, way.parts, strict=False) if one is not None]
        if not all(key is None or key.takes(one.names, one.number, one.count) for one, key in above):
            continue
        labels = ["+".join(one.names) or str(one.number) for one, _ in above]
        key = way.parts[-1].key if run.array else None
        size = np.dtype(run.code).itemsize
        for k in _few(run.count, key):
            name = run.names[k] if run.names else str(k)
            if key is not None and not key.takes((name,), k, run.count):
                continue
            label = " ".join([*labels, name] if run.array else labels)
            used[label] = used.get(label, 0) + 1
            again = "" if used[label] == 1 else f" #{used[label]}"
            result.append(Leaf(label + again, run.offset + k * size, run.code))
        if len(result) > MAX_LEAVES:
            raise CdrError(MANY)
    return tuple(result)


def _few(count: int, key: Key | None) -> Sequence[int]:
    """Which numbers of an array may be meant: all, unless it is long and numbers are asked for."""
    if count <= MAX_LEAVES:
        return range(count)
    asked = [int(word) % count for word in (key.words if key else ()) if word.lstrip("-").isdecimal()]
    if not asked:
        raise CdrError(MANY)
    return asked[:MAX_LEAVES]


def _numbers(data: bytes, at: Int, code: str) -> Array:
    """(T,) the numbers that begin at these bytes."""
    return every(data, code)[at].astype(np.float64)
