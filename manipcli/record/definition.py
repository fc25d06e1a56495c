"""The message types of any ROS 2 log: the `ros2msg` text of a schema to a tree of types.

Nothing in a text is trusted: types may be missing, contain themselves, or be nested without end.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

MAX_TEXT = 1 << 20
"""Characters of one schema."""
MAX_DEPTH = 24
"""Messages within messages."""
MAX_FIELDS = 4096
"""Of one schema, all its types together."""

NUMBERS = {
    "bool": "|u1", "byte": "|u1", "char": "|u1", "uint8": "|u1", "int8": "|i1", "uint16": "<u2", "int16": "<i2",
    "uint32": "<u4", "int32": "<i4", "uint64": "<u8", "int64": "<i8", "float32": "<f4", "float64": "<f8",
}  # fmt: skip
_TIME = "int32 sec\nuint32 nanosec\n"
_KNOWN = {"builtin_interfaces/Time": _TIME, "builtin_interfaces/Duration": _TIME}
"""What some writers leave out, since every ROS 2 has it."""
_SEPARATOR = re.compile(r"^={10,}\s*$", re.MULTILINE)
_FIELD = re.compile(
    r"(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?:<=)?(?P<bound>\d*)\])?\s+(?P<name>[A-Za-z]\w*)\s*(?P<sign>=?)"
)


class UnknownDefinition(ValueError):
    """A schema that cannot be read; says why."""


@dataclass(frozen=True, slots=True)
class Number:
    """One number, or truth value; `code` is that of numpy."""

    name: str

    @property
    def code(self) -> str:
        return NUMBERS[self.name]

    @property
    def size(self) -> int:
        return int(self.code[-1])


@dataclass(frozen=True, slots=True)
class Text:
    """A string."""


@dataclass(frozen=True, slots=True)
class Array:
    """Several of one type; `length` is None where each message says how many."""

    element: Number | Text | Message
    length: int | None


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message."""

    name: str
    type: Type


@dataclass(frozen=True, slots=True)
class Message:
    """A message type, `sensor_msgs/JointState`, and its fields in the order of their bytes."""

    name: str
    fields: tuple[Field, ...]

    @property
    def is_time(self) -> bool:
        """A time or a duration: whole seconds and nanoseconds, one number."""
        return self.name in _KNOWN and [one.name for one in self.fields] == ["sec", "nanosec"]

    def field(self, name: str) -> Field | None:
        """The field of that name."""
        return next((one for one in self.fields if one.name == name), None)


Type = Number | Text | Array | Message


def read_definition(name: str, text: str) -> Message:
    """The type `name` (`package/msg/Name` or `package/Name`), whose definition begins the text.

    Args:
        name: of the type.
        text: its definition, then those it uses, each behind a line of `=` and a line `MSG: package/Name`.

    Raises:
        UnknownDefinition: a line or a type that is none, a type within itself, or a bound is passed.
    """
    if len(text) > MAX_TEXT:
        raise UnknownDefinition(f"its definition is longer than {MAX_TEXT} characters")
    first, *others = _SEPARATOR.split(text)
    known = dict(_KNOWN)
    for other in others:
        head, _, body = other.strip().partition("\n")
        if not head.startswith("MSG:"):
            raise UnknownDefinition(f"'{head[:40]}' stands where MSG: is expected")
        known[_short(head.removeprefix("MSG:").strip())] = body
    root = _short(name)
    known[root] = first
    return _Reader(known).message(root, ())


def _short(name: str) -> str:
    """`package/Name`."""
    return name.replace("/msg/", "/")


class _Reader:
    """Makes each type once."""

    def __init__(self, known: dict[str, str]) -> None:
        self._known = known
        self._made: dict[str, Message] = {}
        self._fields = 0

    def message(self, name: str, above: tuple[str, ...]) -> Message:
        if name in above:
            raise UnknownDefinition(f"{name} contains itself")
        if len(above) >= MAX_DEPTH:
            raise UnknownDefinition(f"messages are nested deeper than {MAX_DEPTH}")
        if name not in self._made:
            self._made[name] = Message(name, tuple(self._each(name, (*above, name))))
        return self._made[name]

    def _each(self, name: str, above: tuple[str, ...]) -> Iterator[Field]:
        package = name.rpartition("/")[0]
        for line in self._known[name].splitlines():
            stripped = line.strip()
            if not stripped or stripped.startswith("#"):
                continue
            found = _FIELD.match(stripped)
            if found is None:
                raise UnknownDefinition(f"{name}: '{stripped[:60]}' is no field")
            if found["sign"]:
                continue  # a constant: it has no bytes
            self._fields += 1
            if self._fields > MAX_FIELDS:
                raise UnknownDefinition(f"it has more than {MAX_FIELDS} fields")
            element = self._type(found["type"], package, above)
            bounded = "<=" in (found["array"] or "")
            length = int(found["bound"]) if found["bound"] and not bounded else None
            yield Field(found["name"], element if found["array"] is None else Array(element, length))

    def _type(self, word: str, package: str, above: tuple[str, ...]) -> Number | Text | Message:
        if word in NUMBERS:
            return Number(word)
        if word == "string":
            return Text()
        # A type of the same package goes without its name, and `Header` without std_msgs.
        for name in (_short(word),) if "/" in word else (f"{package}/{word}", f"std_msgs/{word}"):
            if name in self._known:
                return self.message(name, above)
        raise UnknownDefinition(f"it uses the type '{word}', which it does not define")
