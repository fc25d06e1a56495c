"""Where the wanted numbers stand in the bytes of a message, by the definition of its type alone.

A message is walked from its first byte to its last. What decides where things stand (lengths, and the names by which
elements are told apart) is kept with the result: another message in which those bytes are the same has the same
layout, and thousands of messages are read at once by it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.definition import Array, Message, Number, Text, Type

MAX_LEAVES = 2000
"""Wanted numbers in one message."""
MAX_NAME = 256
"""[byte] A longer text names nothing."""
MAX_STEPS = 2_000_000
"""Values that one walk passes at most: more are in no message that anybody plots."""


@dataclass(frozen=True, slots=True)
class Key:
    """What stands in brackets: `words`, one of which an element must bear; of a word `a+b` it bears every part."""

    words: tuple[str, ...]

    def takes(self, names: tuple[str, ...]) -> bool:
        """Whether an element with these names is meant."""
        return any(word in names or set(word.split("+")) <= set(names) for word in self.words)


@dataclass(frozen=True, slots=True)
class Part:
    """One field on the way to the wanted number; `key` where only some of its elements are meant."""

    name: str
    key: Key | None = None


@dataclass(frozen=True, slots=True)
class Leaf:
    """A number: the names of the elements it is in, where its bytes are, and its code. `time`: nanoseconds follow."""

    label: str
    offset: int
    code: str
    time: bool = False


@dataclass(frozen=True, slots=True)
class Layout:
    """The wanted numbers of a message.

    `guards`: offsets of all bytes that decided where they are; `steps`: values that were passed to find them.
    """

    leaves: tuple[Leaf, ...]
    guards: tuple[int, ...]
    steps: int = 0


@dataclass(slots=True)
class _Found:
    """A leaf on its way up: `names` of elements so far, outermost first; `position`: its number in an unnamed array."""

    offset: int
    code: str
    time: bool
    names: list[str] = field(default_factory=list)
    position: tuple[int, int] | None = None
    key: Key | None = None


def layout(message: Message, way: tuple[Part, ...], data: bytes | memoryview) -> Layout:
    """Where the numbers at the end of `way` stand in one message of a type.

    Raises:
        CdrError: it is shorter than its lengths say, or too large to be looked through.
    """
    walk = _Walk(data)
    found = walk.message(message, way)
    leaves = tuple(
        Leaf(" ".join(one.names), one.offset, one.code, one.time) for one in found if _resolved(one, named=())
    )
    return Layout(leaves, tuple(walk.guards), walk.steps)


def _resolved(one: _Found, *, named: tuple[str, ...]) -> bool:
    """Gives a number of an array its name, where it still has none; whether it is wanted."""
    if one.position is None:
        return True
    number, count = one.position
    name = named[number] if len(named) == count else str(number)
    one.position = None
    if one.key is not None and not one.key.takes((name, str(number), str(number - count))):
        return False
    one.names.insert(0, name)
    return True


class _Walk:
    """One pass over one message."""

    def __init__(self, data: bytes | memoryview) -> None:
        self._reader = CdrReader(data)
        self._data = memoryview(data)
        self.steps = 0
        self.guards: list[int] = []

    def message(self, message: Message, way: tuple[Part, ...]) -> list[_Found]:
        """The wanted numbers in a message that begins here."""
        found, _, lists = self._fields(message, way)
        return [one for one in found if self._named(one, lists)]

    def _fields(
        self, message: Message, way: tuple[Part, ...]
    ) -> tuple[list[_Found], list[str], dict[str, tuple[str, ...]]]:
        """The wanted numbers, and the texts and lists of texts that may name elements."""
        self._count()
        found: list[_Found] = []
        texts: list[str] = []
        lists: dict[str, tuple[str, ...]] = {}
        if not message.fields:
            self._reader.skip(1, 1)  # ROS 2 gives an empty message one byte
        for one in message.fields:
            wanted = bool(way) and one.name == way[0].name
            match one.type:
                case Text():
                    texts.append(self._text(keep=bool(way)))
                case Array(element=Text()) as array:
                    names = self._texts(array, keep=bool(way))
                    if names:
                        lists[one.name] = names
                case _ if wanted:
                    found += self._wanted(one.type, way)
                case _:
                    self._skip(one.type)
        return found, texts, lists

    def _named(self, one: _Found, lists: dict[str, tuple[str, ...]]) -> bool:
        """Names a number of an array after the list of names beside it; where there is none, it waits for one."""
        if one.position is None:
            return True
        fitting = {name: texts for name, texts in lists.items() if len(texts) == one.position[1]}
        best = min(fitting, key=lambda name: "name" not in name, default=None)
        return best is None or _resolved(one, named=fitting[best])

    def _wanted(self, kind: Type, way: tuple[Part, ...]) -> list[_Found]:
        match kind:
            case Number():
                return [_Found(self._number(kind), kind.code, False)]
            case Message() if kind.is_time and len(way) == 1:
                return [_Found(self._reader.skip(8, 4), "<i4", True)]
            case Message():
                return self.message(kind, way[1:])
            case Array():
                return self._elements(kind, way)
            case _:
                return []

    def _elements(self, array: Array, way: tuple[Part, ...]) -> list[_Found]:
        count, key = self._length(array), way[0].key
        match array.element:
            case Number() as number:
                first = self._reader.skip(count * number.size, number.size) if count else 0
                few = self._few(count, key)
                return [_Found(first + k * number.size, number.code, False, position=(k, count), key=key) for k in few]
            case Message() as message:
                found: list[_Found] = []
                for k in range(count):
                    inner, texts, lists = self._fields(message, way[1:])
                    if message.is_time:
                        inner = [_Found(self._reader.offset - 8, "<i4", True)] if len(way) == 1 else inner
                    names = tuple(text for text in texts if text)
                    if key is not None and not key.takes((*names, str(k), str(k - count))):
                        continue
                    label = "+".join(names) or str(k)
                    for one in inner:
                        if self._named(one, lists) and _resolved(one, named=()):
                            one.names.insert(0, label)
                            found.append(one)
                    if len(found) > MAX_LEAVES:
                        raise CdrError(MANY)
                return found
            case _:
                return []

    def _few(self, count: int, key: Key | None) -> list[int]:
        """Which numbers of an array may be meant: all, unless it is long and numbers are asked for."""
        if count <= MAX_LEAVES:
            return list(range(count))
        asked = [int(word) % count for word in (key.words if key else ()) if word.lstrip("-").isdecimal()]
        if not asked:
            raise CdrError(MANY)
        return asked[:MAX_LEAVES]

    def _skip(self, kind: Type) -> None:
        match kind:
            case Number():
                self._reader.skip(kind.size, kind.size)
            case Text():
                self._text(keep=False)
            case Message():
                self._fields(kind, ())
            case Array(element=Number() as number):
                count = self._length(kind)
                if count:
                    self._reader.skip(count * number.size, number.size)
            case Array(element=Text()):
                self._texts(kind, keep=False)
            case Array(element=Message() as message):
                for _ in range(self._length(kind)):
                    self._fields(message, ())

    def _number(self, number: Number) -> int:
        return self._reader.skip(number.size, number.size)

    def _length(self, array: Array) -> int:
        """How many elements follow; each takes a byte at least."""
        if array.length is not None:
            count = array.length
        else:
            count = self._reader.count(1)
            self._guard(self._reader.offset - 4, self._reader.offset)
        self._reader.expect(count)
        return count

    def _texts(self, array: Array, *, keep: bool) -> tuple[str, ...]:
        return tuple(self._text(keep=keep) for _ in range(self._length(array)))

    def _text(self, *, keep: bool) -> str:
        """The length decides where things stand; the letters only where they may name something."""
        self._count()
        size = self._reader.u32()
        start = self._reader.skip(size, 1)
        keep = keep and size <= MAX_NAME
        self._guard(self._reader.offset - size - 4, start + size if keep else start)
        return bytes(self._data[start : start + max(size - 1, 0)]).decode("utf-8", "replace") if keep else ""

    def _guard(self, start: int, end: int) -> None:
        self.guards.extend(range(start, end))

    def _count(self) -> None:
        self.steps += 1
        if self.steps > MAX_STEPS:
            raise CdrError("has too many parts to be looked through")


MANY = f"has more than {MAX_LEAVES} numbers there; say which ones in brackets"
