"""JSON of ROS messages, by the definitions that the log embeds: from CDR, and checked from a client.

As in rosbridge: an object with all fields, `uint8[]` as base64 text, NaN and infinity as null.
"""

from __future__ import annotations

import base64
import json
import math
import re
from functools import cache

import numpy as np

from manipcli.core.text import did_you_mean
from manipcli.record.cdr import CdrReader
from manipcli.record.definition import Array, Field, Message, Number, Text, Type, read_definition
from manipcli.record.schemas import schema_text

MAX_VALUES = 200_000
"""Most values in a message from a client."""
_TOO_MANY = f"more than {MAX_VALUES} values in one message"
_SURROGATE = re.compile("[\ud800-\udfff]")
_INTEGERS = {
    "byte": (0, 255), "char": (0, 255), "uint8": (0, 255), "int8": (-128, 127), "uint16": (0, 2**16 - 1),
    "int16": (-(2**15), 2**15 - 1), "uint32": (0, 2**32 - 1), "int32": (-(2**31), 2**31 - 1),
    "uint64": (0, 2**64 - 1), "int64": (-(2**63), 2**63 - 1),
}  # fmt: skip
_OCTETS = ("byte", "char", "uint8")
_OLD_TIME = {"secs": "sec", "nsecs": "nanosec"}
"""Fields of a time in ROS 1, which older clients send."""


class BadMessage(ValueError):
    """JSON that is not a message of its type: the field, what it is, what was expected."""


@cache
def definition(type_name: str) -> Message:
    """The fields of a type of `schemas.py`."""
    name = type_name.replace("/msg/", "/").replace("/action/", "/").replace("/srv/", "/")
    return read_definition(name, schema_text(name))


def to_json(message: Message, data: bytes) -> dict[str, object]:
    """The JSON object of a message in CDR."""
    return _Reading(CdrReader(data)).message(message)


class _Reading:
    def __init__(self, reader: CdrReader) -> None:
        self._reader = reader

    def message(self, message: Message) -> dict[str, object]:
        if not message.fields:
            self._reader.skip(1, 1)
        return {field.name: self._value(field.type) for field in message.fields}

    def _value(self, kind: Type) -> object:
        match kind:
            case Number():
                return self._numbers(kind, 1)[0]
            case Text():
                return self._reader.text()
            case Message():
                return self.message(kind)
            case Array(element=element, length=length):
                count = self._reader.count(1) if length is None else length
                if not isinstance(element, Number):
                    return [self._value(element) for _ in range(count)]
                if element.name in _OCTETS:
                    return base64.b64encode(self._reader.take(count, 1)).decode()
                return self._numbers(element, count) if count else []

    def _numbers(self, kind: Number, count: int) -> list[object]:
        raw = np.frombuffer(self._reader.take(count * kind.size, kind.size), kind.code)
        if kind.name == "bool":
            return [bool(value) for value in raw]
        if kind.name.startswith("float") and not np.isfinite(raw).all():
            return [value if math.isfinite(value) else None for value in raw.tolist()]
        return list(raw.tolist())


def from_json(message: Message, value: object) -> dict[str, object]:
    """The complete message: fields that are left out have their default, else 0, false, "" or empty.

    Raises:
        BadMessage: a field that is unknown, of the wrong type, out of range or not finite; too many values.
    """
    return _Checking().message(message, value, "")


class _Checking:
    def __init__(self) -> None:
        self._left = MAX_VALUES

    def message(self, message: Message, value: object, path: str) -> dict[str, object]:
        if not isinstance(value, dict):
            raise BadMessage(f"{path or 'the message'} is {_word(value)}; expected an object of {message.name}")
        given = {_OLD_TIME.get(key, key): item for key, item in value.items()} if message.is_time else value
        names = [field.name for field in message.fields]
        for key in given:
            if key not in names:
                near = did_you_mean(str(key)[:80], names, kind="fields")
                raise BadMessage(f"{message.name} has no field '{_below(path, str(key)[:80])}'; {near}")
        return {
            field.name: self._value(field.type, given[field.name], _below(path, field.name))
            if field.name in given
            else _default(field)
            for field in message.fields
        }

    def _value(self, kind: Type, value: object, path: str) -> object:
        self._left -= 1
        if self._left < 0:
            raise BadMessage(_TOO_MANY)
        match kind:
            case Number():
                return _number(kind, value, path)
            case Text():
                if not isinstance(value, str):
                    raise BadMessage(f"{path} is {_word(value)}; expected a text")
                if "\0" in value or not (value.isascii() or _SURROGATE.search(value) is None):
                    raise BadMessage(f"{path} has a character that is not allowed in a text")
                return value
            case Message():
                return self.message(kind, value, path)
            case Array(element=element, length=length):
                items = self._items(element, value, path)
                if length is not None and len(items) != length:
                    raise BadMessage(f"{path} has {len(items)} values; expected {length}")
                return [self._value(element, item, f"{path}[{k}]") for k, item in enumerate(items)]

    def _items(self, element: Type, value: object, path: str) -> list[object]:
        if isinstance(value, str) and isinstance(element, Number) and element.name in _OCTETS:
            try:
                return list(base64.b64decode(value, validate=True))
            except ValueError:
                raise BadMessage(f"{path} is not base64") from None
        if not isinstance(value, list):
            raise BadMessage(f"{path} is {_word(value)}; expected a list")
        if len(value) > self._left:
            raise BadMessage(_TOO_MANY)
        return value


def _number(kind: Number, value: object, path: str) -> float | int | bool:
    if kind.name == "bool":
        if not isinstance(value, bool):
            raise BadMessage(f"{path} is {_word(value)}; expected true or false")
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadMessage(f"{path} is {_word(value)}; expected a number")
    if kind.name in _INTEGERS:
        low, high = _INTEGERS[kind.name]
        if value != value or value in (math.inf, -math.inf) or value != int(value) or not low <= value <= high:
            raise BadMessage(f"{path} is {_word(value)}; expected a whole number from {low} to {high}")
        return int(value)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise BadMessage(f"{path} is {_word(value)}; expected a finite number")
    return number


def _default(field: Field) -> object:
    kind = field.type
    match kind:
        case Number(name=name):
            given = field.default or 0.0
            return bool(given) if name == "bool" else given if name.startswith("float") else int(given)
        case Text():
            return ""
        case Message():
            return {below.name: _default(below) for below in kind.fields}
        case Array(element=element, length=length):
            return [_default(Field(field.name, element)) for _ in range(length or 0)]


def _below(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _word(value: object) -> str:
    """A value in an error, shortened."""
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else "a list"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    text = repr(value) if not isinstance(value, int) or abs(value) < 2**64 else "a number of many digits"
    return text if len(text) <= 60 else f"{text[:57]}..."


def compact(message: object) -> str:
    """JSON without spaces."""
    return json.dumps(message, separators=(",", ":"), allow_nan=False)
