"""Decoder of ROS 2 messages of any type: every value with its path and its place in the bytes.

The numbers of an array are one run. Elements of arrays are named by texts in them or in a parallel array, if any:
`position[joint_3]`, `transforms[cup].transform.translation.x`. Messages with the same lengths and names have one
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
"""Most values and arrays in one message."""
MAX_NAME = 256
"""Longest text that is used as a name [byte]."""
REMEMBERED = 16
"""Most cached layouts of one topic."""

Int = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]
T = TypeVar("T")


@dataclass(slots=True)
class Element:
    """An element of an array: its index, the length of the array, its names and its label."""

    number: int
    count: int
    names: tuple[str, ...] = ()
    label: str = ""


Path = tuple[tuple[str, Element | None], ...]
"""Field names from the message down, each with the array element, if any."""


@dataclass(frozen=True, slots=True)
class Run:
    """A run of adjacent values.

    Attributes:
        steps: path of the values.
        offset: aligned offset of the first byte, after the length of an array.
        count: number of values, or bytes of a text.
        code: numpy type code; "" for a text, `#` for the length of an array.
        names: names of the numbers of an array; () without names.
        array: whether the run is an array.
    """

    steps: Path
    offset: int
    count: int
    code: str
    names: tuple[str, ...] = ()
    array: bool = False

    @property
    def fields(self) -> tuple[str, ...]:
        """The path without array elements."""
        return tuple(name for name, _ in self.steps)

    @property
    def path(self) -> str:
        """The path with elements by index: `points[0].positions`."""
        text = ".".join(name if element is None else f"{name}[{element.number}]" for name, element in self.steps)
        return f"{text}.#" if self.code == "#" else text

    @property
    def label(self) -> str:
        """The path with elements by name."""
        text = ".".join(name if element is None else f"{name}[{element.label}]" for name, element in self.steps)
        return f"number of {text}" if self.code == "#" else text

    @property
    def size(self) -> int:
        """Size [byte]."""
        return 4 if self.code == "#" else self.count * (np.dtype(self.code).itemsize if self.code else 1)

    @property
    def begin(self) -> int:
        """Offset of its first byte, including the length of a text."""
        return self.offset - 4 if not self.code else self.offset

    @property
    def end(self) -> int:
        """Offset after its last byte."""
        return self.offset + self.size

    def name(self, k: int) -> str:
        """Label of the k-th number."""
        return f"{self.label}[{self.names[k] if self.names else k}]" if self.array else self.label

    def value(self, data: bytes | memoryview, k: int) -> float | int | str:
        """The k-th number, or the whole text."""
        if not self.code:
            return bytes(data[self.offset : self.offset + max(self.count - 1, 0)]).decode("utf-8", "replace")
        if self.code == "#":
            return self.count
        number: float | int = np.frombuffer(data, self.code, self.count, self.offset)[k].item()
        return number


def runs(message: Message, data: bytes | memoryview) -> tuple[Run, ...]:
    """Every value of one message, in the order of its bytes.

    Raises:
        CdrError: the message is shorter than its lengths declare, or has too many parts.
    """
    return tuple(_Walk(data).message(message, (), {}))


class _Walk:
    def __init__(self, data: bytes | memoryview) -> None:
        self._data = data
        self._reader = CdrReader(data)
        self._left = MAX_RUNS

    def message(self, message: Message, above: Path, names: dict[int, tuple[str, ...]]) -> Iterator[Run]:
        """`names`: lists of names in the enclosing messages, by their length."""
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
            element = Element(k, count)
            inner = list(self._value(array.element, above, name, names, element))
            if isinstance(array.element, Message):
                own = (run for run in inner if not run.code and len(run.steps) == len(above) + 2)
                texts = (
                    str(run.value(self._data, 0)) for run in own if run.steps[-1][1] is None and run.count <= MAX_NAME
                )
                element.names = tuple(text for text in texts if text)
            elements.append(element)
            found += inner
        labels = ["+".join(element.names) for element in elements]
        counts = {label: labels.count(label) for label in set(labels)} if count < MAX_NAME else {}
        for element, label in zip(elements, labels, strict=True):
            element.label = label if label and counts.get(label) == 1 else str(element.number)
        yield from found

    def _count(self) -> None:
        self._left -= 1
        if self._left < 0:
            raise CdrError("has too many parts to decode")


@dataclass(frozen=True, slots=True)
class _Layout(Generic[T]):
    """The result for messages of this length with these bytes at these offsets."""

    length: int
    guards: tuple[tuple[int, Bytes], ...]
    made: T


class Layouts(Generic[T]):
    """Groups the messages of a topic by layout.

    Args:
        make: returns the result for the layout of a message, and the byte ranges [begin, end) that define the layout.
    """

    def __init__(self, make: Callable[[memoryview], tuple[T, Sequence[tuple[int, int]]]]) -> None:
        self._make = make
        self._known: deque[_Layout[T]] = deque(maxlen=REMEMBERED)

    def groups(self, data: bytes, starts: Int, lengths: Int) -> Iterator[tuple[T, Int]]:
        """Results of the layouts, each with the indices of its messages.

        Args:
            data: bytes that hold the messages.
            starts, lengths: (n,) offsets and lengths of the messages.

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
        for layout in self._known:
            if layout.length == len(own) and all(np.array_equal(own[at : at + len(x)], x) for at, x in layout.guards):
                return layout
        made, guards = self._make(message)
        merged: list[tuple[int, int]] = []
        for begin, end in sorted(guards):
            if merged and begin - merged[-1][1] < 4:  # only alignment bytes between them
                begin = merged.pop()[0]
            merged.append((begin, end))
        found = _Layout(len(own), tuple((begin, own[begin:end].copy()) for begin, end in merged), made)
        self._known.appendleft(found)
        return found


def rows(data: bytes, starts: Int, size: int) -> Bytes:
    """(T, size) bytes that begin at `starts`; `size` is positive."""
    kind = np.dtype((np.void, size))
    every = np.ndarray((len(data) - size + 1,), dtype=kind, buffer=data, strides=(1,))
    return every[starts].view(np.uint8).reshape(len(starts), size)
