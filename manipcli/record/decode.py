"""Any ROS 2 message taken apart: every value in it, by the path of its fields, in the order of its bytes.

Numbers of an array are one run. What an array holds is called by the names beside it, where there are such:
`position[joint_3]`, `transforms[cup].transform.translation.x`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.definition import Array, Message, Number, Text, Type

MAX_RUNS = 200_000
"""Values and arrays in one message: more are in none that robots publish."""


@dataclass(frozen=True, slots=True)
class Run:
    """Values that stand side by side.

    Attributes:
        path: of fields, elements by their number: `points[0].positions`.
        label: the same, elements by their names.
        offset: of the first byte; aligned, behind the length of an array.
        count: numbers, or bytes of a text.
        code: of numpy; "" is a text, `#` the length of an array.
        names: of the numbers of an array; () where they have none.
        array: whether the numbers are those of an array.
    """

    path: str
    label: str
    offset: int
    count: int
    code: str
    names: tuple[str, ...] = ()
    array: bool = False

    @property
    def size(self) -> int:
        """[byte]"""
        return 4 if self.code == "#" else self.count * (np.dtype(self.code).itemsize if self.code else 1)

    def name(self, k: int) -> str:
        """How number `k` is called."""
        if not self.array:
            return self.label
        return f"{self.label}[{self.names[k] if len(self.names) == self.count else k}]"

    def value(self, data: bytes, k: int) -> float | int | str:
        """Number `k` of it, or the whole text."""
        if not self.code:
            return bytes(data[self.offset : self.offset + max(self.count - 1, 0)]).decode("utf-8", "replace")
        if self.code == "#":
            return self.count
        number: float | int = np.frombuffer(data, self.code, self.count, self.offset)[k].item()
        return number


def runs(message: Message, data: bytes) -> tuple[Run, ...]:
    """Every value of one message.

    Raises:
        CdrError: it is shorter than its lengths say, or has too many parts.
    """
    walk = _Walk(data)
    return tuple(walk.message(message, {}))


class _Walk:
    """One pass over one message."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._reader = CdrReader(data)
        self._left = MAX_RUNS

    def message(self, message: Message, above: dict[int, tuple[str, ...]]) -> Iterator[Run]:
        """`above`: lists of names of the messages around it, by their length."""
        if not message.fields:
            self._reader.skip(1, 1)  # ROS 2 gives an empty message one byte
        names = dict(above)
        for field in message.fields:
            kind = field.type
            if isinstance(kind, Array) and isinstance(kind.element, Text):
                texts = list(self._below(field.name, kind, names))
                named = tuple(str(run.value(self._data, 0)) for run in texts if not run.code)
                if len(set(named)) == len(named):
                    names.setdefault(len(named), named)
                yield from texts
            else:
                yield from self._below(field.name, kind, names)

    def _below(self, name: str, kind: Type, names: dict[int, tuple[str, ...]]) -> Iterator[Run]:
        self._left -= 1
        if self._left < 0:
            raise CdrError("has too many parts to be looked through")
        match kind:
            case Number():
                yield Run(name, name, self._reader.skip(kind.size, kind.size), 1, kind.code)
            case Text():
                yield self._text(name)
            case Message():
                for run in self.message(kind, names):
                    yield _under(run, name, name)
            case Array():
                yield from self._array(name, kind, names)

    def _array(self, name: str, array: Array, names: dict[int, tuple[str, ...]]) -> Iterator[Run]:
        count = array.length
        if count is None:
            count = self._reader.count(1)
            yield Run(f"{name}.#", f"number of {name}", self._reader.offset - 4, count, "#")
        self._reader.expect(count)
        match array.element:
            case Number() as number:
                if count:
                    offset = self._reader.skip(count * number.size, number.size)
                    yield Run(name, name, offset, count, number.code, names.get(count, ()), array=True)
            case Text():
                for k in range(count):
                    yield self._text(f"{name}[{k}]")
            case Message() as message:
                elements = [list(self.message(message, names)) for _ in range(count)]
                called = [self._called(message, element) for element in elements]
                for k, element in enumerate(elements):
                    known = called[k] if called[k] and called.count(called[k]) == 1 else str(k)
                    for run in element:
                        yield _under(run, f"{name}[{k}]", f"{name}[{known}]")

    def _called(self, message: Message, element: list[Run]) -> str:
        """The texts that stand directly in an element: a child frame, or the two that touch."""
        own = {field.name for field in message.fields}
        texts = (str(run.value(self._data, 0)) for run in element if not run.code and run.path in own)
        return "+".join(text for text in texts if text)

    def _text(self, name: str) -> Run:
        self._left -= 1
        size = self._reader.u32()
        return Run(name, name, self._reader.skip(size, 1), size, "")


def _under(run: Run, path: str, label: str) -> Run:
    """`run`, in a field or an element."""
    inner = run.label.removeprefix("number of ")
    head = "number of " if inner != run.label else ""
    return replace(run, path=f"{path}.{run.path}", label=f"{head}{label}.{inner}")
