"""Parser of ROS 2 message definitions: from the `ros2msg` text of a schema to a tree of types.

The text is untrusted: types can be missing, recursive or nested too deeply.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

MAX_TEXT = 1 << 20
"""Longest schema [characters]."""
MAX_DEPTH = 24
"""Deepest nesting of messages."""
MAX_FIELDS = 4096
"""Most fields of all types of one schema."""

NUMBERS = {
    "bool": "|u1", "byte": "|u1", "char": "|u1", "uint8": "|u1", "int8": "|i1", "uint16": "<u2", "int16": "<i2",
    "uint32": "<u4", "int32": "<i4", "uint64": "<u8", "int64": "<i8", "float32": "<f4", "float64": "<f8",
}  # fmt: skip
_TIME = "int32 sec\nuint32 nanosec\n"
_KNOWN = {"builtin_interfaces/Time": _TIME, "builtin_interfaces/Duration": _TIME}
"""Standard types that some writers leave out."""
_SEPARATOR = re.compile(r"^={10,}\s*$", re.MULTILINE)
_FIELD = re.compile(
    r"(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?:<=)?(?P<bound>\d*)\])?\s+(?P<name>[A-Za-z]\w*)\s*(?P<sign>=?)"
)


class UnknownDefinition(ValueError):
    """A schema that cannot be read, with the reason."""


@dataclass(frozen=True, slots=True)
class Number:
    """A number or boolean; `code` is its numpy type code."""

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
    """An array of one type; `length` is None for a variable length."""

    element: Number | Text | Message
    length: int | None


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message. `default`: of a number that has one other than 0, such as `float64 w 1`."""

    name: str
    type: Type
    default: float | None = None


@dataclass(frozen=True, slots=True)
class Message:
    """A message type, `sensor_msgs/JointState`, and its fields in the order of their bytes."""

    name: str
    fields: tuple[Field, ...]

    @property
    def is_time(self) -> bool:
        """Whether it is a time or a duration: seconds and nanoseconds, shown as one number."""
        return self.name in _KNOWN and [field.name for field in self.fields] == ["sec", "nanosec"]

    def field(self, name: str) -> Field | None:
        """The field with this name, or None."""
        return next((candidate for candidate in self.fields if candidate.name == name), None)


Type = Number | Text | Array | Message


def read_definition(name: str, text: str) -> Message:
    """The type `name` (`package/msg/Name` or `package/Name`), whose definition is first in the text.

    Args:
        name: name of the type.
        text: its definition, then those it uses, each after a line of `=` and a line `MSG: package/Name`.

    Raises:
        UnknownDefinition: an invalid line or type, a recursive type, or a limit is exceeded.
    """
    if len(text) > MAX_TEXT:
        raise UnknownDefinition(f"definition longer than {MAX_TEXT} characters")
    first, *others = _SEPARATOR.split(text)
    known = dict(_KNOWN)
    for other in others:
        head, _, body = other.strip().partition("\n")
        if not head.startswith("MSG:"):
            raise UnknownDefinition(f"expected MSG:, found '{head[:40]}'")
        known[_short(head.removeprefix("MSG:").strip())] = body
    root = _short(name)
    known[root] = first
    return _Reader(known).message(root, ())


def _short(name: str) -> str:
    """`package/Name`."""
    return name.replace("/msg/", "/")


def _default(kind: Number | Text | Message, rest: str) -> float | None:
    """The default of a field, from the rest of its line; None without one, or if it is no number."""
    try:
        return float(rest.partition("#")[0]) if isinstance(kind, Number) else None
    except ValueError:
        return None


class _Reader:
    """Parses each type once."""

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
                raise UnknownDefinition(f"{name}: '{stripped[:60]}' is not a field")
            if found["sign"]:
                continue  # a constant has no bytes
            self._fields += 1
            if self._fields > MAX_FIELDS:
                raise UnknownDefinition(f"more than {MAX_FIELDS} fields")
            element = self._type(found["type"], package, above)
            bounded = "<=" in (found["array"] or "")
            length = int(found["bound"]) if found["bound"] and not bounded else None
            if found["array"] is not None:
                yield Field(found["name"], Array(element, length))
            else:
                yield Field(found["name"], element, _default(element, stripped[found.end() :]))

    def _type(self, word: str, package: str, above: tuple[str, ...]) -> Number | Text | Message:
        if word in NUMBERS:
            return Number(word)
        if word == "string":
            return Text()
        # Types of the same package, and `Header` of std_msgs, can omit the package.
        for name in (_short(word),) if "/" in word else (f"{package}/{word}", f"std_msgs/{word}"):
            if name in self._known:
                return self.message(name, above)
        raise UnknownDefinition(f"type '{word}' is used but not defined")
