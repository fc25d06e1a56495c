"""Decoder of ROS 2 messages of any type: every value with its path and its place in the bytes.

The numbers of an array are one run. Elements of arrays are named by the texts in them or beside them, where there are
any: `position[joint_3]`, `transforms[cup].transform.translation.x`. Messages with the same lengths and names have one
layout, so that thousands of them are read with one numpy index per number.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.definition import Array, Message, Number, Text, Type

MAX_RUNS = 200_000
"""Values and arrays in one message."""
MAX_NAME = 256
"""[byte] A longer text is not a name."""
REMEMBERED = 16
"""Layouts of one topic that are tried before a message is decoded."""

Int = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]
T = TypeVar("T")


@dataclass(slots=True)
class Element:
    """An element of an array: its number of how many, its names, and its label among the others."""

    number: int
    count: int
    names: tuple[str, ...] = ()
    label: str = ""


Path = tuple[tuple[str, Element | None], ...]
"""Fields from the message down, and the elements that were entered."""


@dataclass(frozen=True, slots=True)
class Run:
    """Adjacent values.

    Attributes:
        steps: where they are.
        offset: of the first byte; aligned, behind the length of an array.
        count: numbers, or bytes of a text.
        code: of numpy; "" is a text, `#` the length of an array.
        names: of the numbers of an array; () where they have none.
        array: whether the numbers are those of an array.
    """

    steps: Path
    offset: int
    count: int
    code: str
    names: tuple[str, ...] = ()
    array: bool = False

    @property
    def fields(self) -> tuple[str, ...]:
        """Without the elements that were entered."""
        return tuple(name for name, _ in self.steps)

    @property
    def path(self) -> str:
        """Fields, and elements by their number: `points[0].positions`."""
        text = ".".join(name if one is None else f"{name}[{one.number}]" for name, one in self.steps)
        return f"{text}.#" if self.code == "#" else text

    @property
    def label(self) -> str:
        """Fields, and elements by their names."""
        text = ".".join(name if one is None else f"{name}[{one.label}]" for name, one in self.steps)
        return f"number of {text}" if self.code == "#" else text

    @property
    def size(self) -> int:
        """[byte]"""
        return 4 if self.code == "#" else self.count * (np.dtype(self.code).itemsize if self.code else 1)

    @property
    def begin(self) -> int:
        """Of its first byte, with the length before a text."""
        return self.offset - 4 if not self.code else self.offset

    @property
    def end(self) -> int:
        """Behind its last byte."""
        return self.offset + self.size

    def name(self, k: int) -> str:
        """Label of number `k`."""
        return f"{self.label}[{self.names[k] if self.names else k}]" if self.array else self.label

    def value(self, data: bytes | memoryview, k: int) -> float | int | str:
        """Number `k`, or the whole text."""
        if not self.code:
            return bytes(data[self.offset : self.offset + max(self.count - 1, 0)]).decode("utf-8", "replace")
        if self.code == "#":
            return self.count
        number: float | int = np.frombuffer(data, self.code, self.count, self.offset)[k].item()
        return number


def runs(message: Message, data: bytes | memoryview) -> tuple[Run, ...]:
    """Every value of one message, in the order of its bytes.

    Raises:
        CdrError: it is shorter than its lengths say, or has too many parts.
    """
    return tuple(_Walk(data).message(message, (), {}))


class _Walk:
    def __init__(self, data: bytes | memoryview) -> None:
        self._data = data
        self._reader = CdrReader(data)
        self._left = MAX_RUNS

    def message(self, message: Message, above: Path, names: dict[int, tuple[str, ...]]) -> Iterator[Run]:
        """`names`: lists of names in the messages around it, by their length."""
        self._count()
        if not message.fields:
            self._reader.skip(1, 1)  # ROS 2 gives an empty message one byte
        known = dict(names)
        for field in message.fields:
            kind = field.type
            found = self._value(kind, above, field.name, known)
            if isinstance(kind, Array) and isinstance(kind.element, Text):
                texts = list(found)
                listed = tuple(str(run.value(self._data, 0)) for run in texts if not run.code)
                if len(set(listed)) == len(listed) and ("name" in field.name or len(listed) not in known):
                    known[len(listed)] = listed
                yield from texts
            else:
                yield from found

    def _value(
        self, kind: Type, above: Path, name: str, names: dict[int, tuple[str, ...]], element: Element | None = None
    ) -> Iterator[Run]:
        path = (*above, (name, element))
        match kind:
            case Number():
                self._count()
                yield Run(path, self._reader.skip(kind.size, kind.size), 1, kind.code)
            case Text():
                self._count()
                size = self._reader.u32()
                yield Run(path, self._reader.skip(size, 1), size, "")
            case Message():
                yield from self.message(kind, path, names)
            case Array():
                yield from self._array(kind, above, name, names)

    def _array(self, array: Array, above: Path, name: str, names: dict[int, tuple[str, ...]]) -> Iterator[Run]:
        self._count()
        count = array.length
        if count is None:
            count = self._reader.count(1)
            yield Run((*above, (name, None)), self._reader.offset - 4, count, "#")
        self._reader.expect(count)
        if isinstance(array.element, Number):
            size = array.element.size
            if count:
                offset = self._reader.skip(count * size, size)
                yield Run((*above, (name, None)), offset, count, array.element.code, names.get(count, ()), array=True)
            return
        elements = []
        found: list[Run] = []
        for k in range(count):
            one = Element(k, count)
            inner = list(self._value(array.element, above, name, names, one))
            if isinstance(array.element, Message):
                own = (run for run in inner if not run.code and len(run.steps) == len(above) + 2)
                texts = (
                    str(run.value(self._data, 0)) for run in own if run.steps[-1][1] is None and run.count <= MAX_NAME
                )
                one.names = tuple(text for text in texts if text)
            elements.append(one)
            found += inner
        labels = ["+".join(one.names) for one in elements]
        counts = {label: labels.count(label) for label in set(labels)} if count < MAX_NAME else {}
        for one, label in zip(elements, labels, strict=True):
            one.label = label if label and counts.get(label) == 1 else str(one.number)
        yield from found

    def _count(self) -> None:
        self._left -= 1
        if self._left < 0:
            raise CdrError("has too many parts to be looked through")


@dataclass(frozen=True, slots=True)
class _Layout(Generic[T]):
    """What was made of the messages that have this length, and these bytes from these offsets on."""

    length: int
    guards: tuple[tuple[int, Bytes], ...]
    made: T


class Layouts(Generic[T]):
    """Messages of one topic in groups of one layout.

    Args:
        make: one message to what is wanted of its layout, and the bytes [begin, end) that other messages share with it.
    """

    def __init__(self, make: Callable[[memoryview], tuple[T, Sequence[tuple[int, int]]]]) -> None:
        self._make = make
        self._known: deque[_Layout[T]] = deque(maxlen=REMEMBERED)

    def groups(self, data: bytes, starts: Int, lengths: Int) -> Iterator[tuple[T, Int]]:
        """A layout, and which of the messages have it.

        Args:
            data: bytes that hold the messages.
            starts, lengths: (n,) of the messages.

        Raises:
            CdrError: from `make`.
        """
        rest = np.arange(len(starts))
        while len(rest):
            start, length = int(starts[rest[0]]), int(lengths[rest[0]])
            layout = self._layout(memoryview(data)[start : start + length])
            alike = lengths[rest] == length
            same = rest if alike.all() else rest[alike]
            for offset, letters in layout.guards:
                unlike = rows(data, starts[same] + offset, len(letters)) != letters
                if unlike.any():
                    same = same[~unlike.any(axis=1)]
            yield layout.made, same
            rest = rest[:0] if len(same) == len(rest) else np.setdiff1d(rest, same, assume_unique=True)

    def _layout(self, message: memoryview) -> _Layout[T]:
        own = np.frombuffer(message, np.uint8)
        for one in self._known:
            if one.length == len(own) and all(np.array_equal(own[at : at + len(x)], x) for at, x in one.guards):
                return one
        made, guards = self._make(message)
        merged: list[tuple[int, int]] = []
        for begin, end in sorted(guards):
            if merged and begin - merged[-1][1] < 4:  # nothing between them but what aligns
                begin = merged.pop()[0]
            merged.append((begin, end))
        found = _Layout(len(own), tuple((begin, own[begin:end].copy()) for begin, end in merged), made)
        self._known.appendleft(found)
        return found


def rows(data: bytes, starts: Int, size: int) -> Bytes:
    """(T, size) the bytes that begin at `starts`; `size` is not 0."""
    kind = np.dtype((np.void, size))
    every = np.ndarray((len(data) - size + 1,), dtype=kind, buffer=data, strides=(1,))
    return every[starts].view(np.uint8).reshape(len(starts), size)
