"""Encoding of a message from its definition: of any type in `schemas.py`, from the values of some of its fields.

Fields without a value have their default, else zero or "", and arrays of variable length are empty. A header gets a
stamp and a frame. Numbers that change later are found by the paths of their fields.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from manipcli.record.cdr import CdrWriter
from manipcli.record.definition import Array, Field, Message, Number, Text, Type, read_definition
from manipcli.record.schemas import schema_text


@dataclass(frozen=True, slots=True)
class Run:
    """Consecutive numbers of a message: offset of the first [byte], how many, and their numpy type."""

    offset: int
    count: int
    code: str


@dataclass(frozen=True, slots=True)
class Encoded:
    """A message, the offset of the stamp of its header (-1: it has none), and the runs of numbers in its `filled`
    fields."""

    data: bytes
    stamp: int
    runs: tuple[Run, ...]


def encode(
    kind: str, fields: Mapping[str, object], *, ns: int = 0, frame: str = "", filled: Sequence[str] = ()
) -> Encoded:
    """A message of the type `kind` (`sensor_msgs/msg/Imu`).

    Args:
        kind: its type.
        fields: values by path (`info.height`, or nested mappings): numbers, text, arrays as numpy arrays, bytes or
            sequences, and arrays of messages as sequences of mappings.
        ns, frame: of its header.
        filled: paths of fields whose numbers are located, in this order.

    Raises:
        KeyError: a path that is not a field of the message.
    """
    writer = _Writer(ns, frame, set(filled))
    values = _nested(fields)
    writer.message(_definition(kind), values, "")
    missing = [path for path in filled if path not in writer.found]
    if missing or writer.unknown:
        raise KeyError(f"{kind} has no field '{[*missing, *writer.unknown][0]}'")
    return Encoded(writer.cdr.data, writer.stamp, _merged([run for path in filled for run in writer.found[path]]))


def _merged(runs: Sequence[Run]) -> tuple[Run, ...]:
    """The runs, those that follow each other without a gap as one."""
    merged: list[Run] = []
    for run in runs:
        last = merged[-1] if merged else None
        if last is not None and last.code == run.code and last.offset + last.count * int(last.code[-1]) == run.offset:
            merged[-1] = Run(last.offset, last.count + run.count, run.code)
        else:
            merged.append(run)
    return tuple(merged)


@lru_cache(maxsize=64)
def _definition(kind: str) -> Message:
    return read_definition(kind, schema_text(kind))


def _nested(fields: Mapping[str, object]) -> dict[str, object]:
    """The values by field, those of inner fields in mappings."""
    found: dict[str, object] = {}
    for path, value in fields.items():
        head, _, rest = path.partition(".")
        if rest:
            inner = found.setdefault(head, {})
            assert isinstance(inner, dict)
            found[head] = {**inner, **_nested({rest: value})}
        else:
            found[head] = value
    return found


class _Writer:
    def __init__(self, ns: int, frame: str, filled: set[str]) -> None:
        self.cdr = CdrWriter()
        self.stamp = -1
        self.found: dict[str, list[Run]] = {path: [] for path in filled}
        self.unknown: list[str] = []
        self._ns, self._frame = ns, frame
        self._active: list[Run] | None = None

    def message(self, message: Message, values: Mapping[str, object], above: str) -> None:
        self.unknown += [above + name for name in values if message.field(name) is None]
        for field in message.fields:
            path = above + field.name
            outer = self._active
            self._active = self.found.get(path, outer)
            if not above and field.name == "header":
                self.stamp = self.cdr.header(self._ns, self._frame)
            else:
                self._value(field.type, values.get(field.name, _default(field)), path)
            self._active = outer

    def _value(self, kind: Type, value: object, path: str) -> None:
        if isinstance(kind, Message):
            self.message(kind, value if isinstance(value, Mapping) else {}, f"{path}.")
        elif isinstance(kind, Array):
            self._array(kind, value, path)
        elif isinstance(kind, Number):
            self._numbers(kind, np.array([value]))
        else:
            self.cdr.text(str(value))

    def _array(self, kind: Array, value: object, path: str) -> None:
        element = kind.element
        if isinstance(element, Number):
            many = np.frombuffer(value, dtype="u1") if isinstance(value, bytes) else np.ravel(np.asarray(value))
            if kind.length is None:
                self.cdr.u32(len(many))
            elif len(many) != kind.length:
                many = np.resize(many, kind.length) if len(many) else np.zeros(kind.length)
            if len(many):
                self._numbers(element, many)
            return
        items = list(value) if isinstance(value, Sequence) else []
        if kind.length is None:
            self.cdr.u32(len(items))
        for item in items:
            if isinstance(element, Text):
                self.cdr.text(str(item))
            else:
                self._value(element, item, path)

    def _numbers(self, kind: Number, values: np.ndarray[tuple[int], np.dtype[np.generic]]) -> None:
        offset = self.cdr.numbers(values.astype(kind.code).tobytes(), kind.size)
        if self._active is not None:
            self._active.append(Run(offset, len(values), kind.code))


def _default(field: Field) -> object:
    """The value of a field that is not given."""
    if isinstance(field.type, Number):
        return 0 if field.default is None else field.default
    return "" if isinstance(field.type, Text) else ()
