"""Time series of numbers in any ROS 2 log, decoded by the message definitions in the log.

Messages with the same layout are read together, with one numpy index per number.
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
from manipcli.record.foreign.topic_fields import Key, Way
from manipcli.record.foreign.topics import Topics
from manipcli.record.read.chunk import Places, every
from manipcli.record.schemas import CONTACTS

MAX_VALUES = 50_000_000
"""Most values of all series together: 800 MB with their times."""
MAX_DECODED = 10_000_000
"""Most values of messages with individual layouts, about a minute of reading."""
MAX_LEAVES = 2000
"""Most wanted numbers in one message."""
MANY = f"has more than {MAX_LEAVES} numbers in this field; select some with brackets"


@dataclass(frozen=True, slots=True)
class Wanted:
    """A requested field of a topic with its message type."""

    topic: str
    message: Message
    way: Way


@dataclass(frozen=True, slots=True)
class Leaf:
    """A requested number: label of its array elements, offset in the message, and type code."""

    label: str
    offset: int
    code: str


@dataclass(frozen=True, slots=True)
class Series:
    """A number over time.

    Attributes:
        label: its array elements (`joint_1`, `cup`); "" outside of arrays.
        times: (T,) log times since the first message of the log [s].
        values: (T,); NaN at the start of a gap.
        held: each value holds until the next one.
    """

    label: str
    times: Array
    values: Array
    held: bool = False


def read_series(
    topics: Topics, wanted: Sequence[Wanted], *, start: float = -np.inf, end: float = np.inf
) -> list[list[Series]]:
    """The series of each field, in the order of their first appearance, or by number.

    Args:
        topics: topics of the log.
        wanted: fields, read in one pass over the file.
        start, end: time range [s]; a value that holds at `start` begins there.

    Raises:
        BadRecording: a message does not match its type, or the values exceed the memory limit.
    """
    gathered = [_Gathered(field.way, field.message, held=topics.all[field.topic].type == CONTACTS) for field in wanted]
    of: dict[str, list[_Gathered]] = {}
    for field, into in zip(wanted, gathered, strict=True):
        of.setdefault(field.topic, []).append(into)
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
                f"more than {MAX_VALUES} numbers requested",
                hint="select fewer fields, or a time range with --from and --to",
            )
    return [into.series() for into in gathered]


def _between(
    topics: Topics, names: Collection[str], start: float, end: float
) -> Iterator[tuple[str, bytes, Places, Array]]:
    """The messages from `start` to `end` and their times [s]; for topics whose messages hold until the next one, also
    the last message before `start`, with the time `start`."""
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
    """The series of one field while the log is read."""

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
        """Add a block of messages; returns the number of values."""
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
            raise CdrError("has a different layout in too many messages")
        fields = tuple(part.name for part in self._way.parts)
        names = [run for run in found if not run.code and _names(run.fields, fields)]
        # The layout depends on lengths, and on texts along the path, which name the elements.
        guards = [(run.begin, run.begin + 4) for run in found if run.code in ("", "#")]
        guards += [(run.offset, run.end) for run in names]
        return leaves(found, self._way), guards

    def series(self) -> list[Series]:
        """The series."""
        labels = list(self._parts)
        if all(label.isdecimal() for label in labels):
            labels.sort(key=int)
        return [self._one(label) for label in labels]

    def _one(self, label: str) -> Series:
        times, values = (np.concatenate(column) for column in zip(*self._parts[label], strict=True))
        order = np.argsort(times, kind="stable")
        times, values = times[order], values[order]
        if self._held:
            # Each message lists all contacts: a missing pair has no contact.
            seen = np.unique(np.concatenate(self._seen))
            whole = np.full(len(seen), np.nan)
            whole[np.searchsorted(seen, times)] = values
            times, values = seen, whole
        return Series(label, frozen(times), frozen(values), self._held)


def _names(text: tuple[str, ...], fields: tuple[str, ...]) -> bool:
    """Whether a text is in a message on the path to a number, so that it can name an element."""
    return text[:-1] == fields[: len(text) - 1] and len(text) <= len(fields)


def leaves(found: Sequence[Run], way: Way) -> tuple[Leaf, ...]:
    """The requested numbers of a message; repeated labels are numbered.

    Raises:
        CdrError: too many numbers.
    """
    fields = tuple(part.name for part in way.parts) + (("sec",) if way.is_time else ())
    result: list[Leaf] = []
    used: dict[str, int] = {}
    for run in found:
        if run.code in ("", "#") or len(run.steps) != len(fields) or run.fields != fields:
            continue
        above = [(at, part.key) for (_, at), part in zip(run.steps, way.parts, strict=False) if at is not None]
        if not all(key is None or key.takes(at.names, at.number, at.count) for at, key in above):
            continue
        labels = ["+".join(at.names) or str(at.number) for at, _ in above]
        key = way.parts[-1].key if run.array else None
        size = np.dtype(run.code).itemsize
        for k in _few(run.count, key):
            name = run.names[k] if run.names else str(k)
            if key is not None and not key.takes((name,), k, run.count):
                continue
            label = " ".join([*labels, name] if run.array else labels)
            used[label] = used.get(label, 0) + 1
            suffix = "" if used[label] == 1 else f" #{used[label]}"
            result.append(Leaf(label + suffix, run.offset + k * size, run.code))
        if len(result) > MAX_LEAVES:
            raise CdrError(MANY)
    return tuple(result)


def _few(count: int, key: Key | None) -> Sequence[int]:
    """Indices of an array that can match: all, except for a long array with indices in brackets."""
    if count <= MAX_LEAVES:
        return range(count)
    asked = [int(word) % count for word in (key.words if key else ()) if word.lstrip("-").isdecimal()]
    if not asked:
        raise CdrError(MANY)
    return asked[:MAX_LEAVES]


def _numbers(data: bytes, at: Int, code: str) -> Array:
    """(T,) numbers at these byte offsets."""
    return every(data, code)[at].astype(np.float64)
