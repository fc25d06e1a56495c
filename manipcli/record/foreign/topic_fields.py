"""Names of numbers in a log: `TOPIC.FIELD`, such as `joint_states.position[joint_1]` or `tf[cup].translation.z`.

Brackets select elements of an array by index, or by a name in the element or in a parallel array (`name`,
`joint_names`); `[a,b]` selects several, `[a+b]` the element with both names. Fields of nested messages are found
without the outer names: `tf[cup].translation.z` is `tf.transforms[cup].transform.translation.z`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

from manipcli.core.text import any_of, did_you_mean, listed, nearest, shorten
from manipcli.record.definition import MAX_DEPTH, Array, Field, Message, Number, Text, Type

MAX_WAYS = 64
"""Most fields of one word."""
MAX_LOOKED_AT = 20_000
"""Most visited fields for one word, since nested types can have very many."""
_NAME = re.compile(r"(?P<topic>[^.\[\]]+)")
_PART = re.compile(r"\.(?P<name>\w+)|\[(?P<key>[^\[\]]*)\]")
_UNINTERESTING = frozenset({"header", "time_from_start"})
"""Fields left out of a whole message."""


@dataclass(frozen=True, slots=True)
class Key:
    """Content of brackets: an element must match one of `words`; for a word `a+b` it must match every part."""

    words: tuple[str, ...]

    def takes(self, names: tuple[str, ...], number: int, count: int) -> bool:
        """Whether the element with these names and index `number` of `count` matches."""
        known = {*names, str(number), str(number - count)}
        return any(word in known or set(word.split("+")) <= known for word in self.words)


@dataclass(frozen=True, slots=True)
class Part:
    """One field of the path to a number; `key` selects some of its elements."""

    name: str
    key: Key | None = None


class UnknownField(ValueError):
    """A missing field, with a hint."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True, slots=True)
class FieldName:
    """A field name as written: `topic` with its leading `/`; `key`: brackets after the topic."""

    text: str
    topic: str
    key: Key | None
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class Way:
    """Path to an existing field: all parts from the message down, and the type that contains it.

    `many`: the field is a list of numbers; `is_time`: it is a time in seconds.
    """

    parts: tuple[Part, ...]
    holder: Message
    many: bool = False
    is_time: bool = False

    @property
    def name(self) -> str:
        """The parts without brackets."""
        return ".".join(part.name for part in self.parts)


def parse_field(text: str) -> FieldName:
    """Parse `TOPIC.FIELD`.

    Raises:
        UnknownField: invalid syntax.
    """
    topic = _NAME.match(text)
    at = topic.end() if topic else 0
    found: list[Part] = []
    first: Key | None = None
    while topic and at < len(text):
        part = _PART.match(text, at)
        if part is None or (part["key"] is not None and not part["key"].strip()):
            break
        at = part.end()
        if part["name"] is not None:
            found.append(Part(part["name"]))
            continue
        key = Key(tuple(word.strip() for word in part["key"].split(",")))
        if not found:
            first = key
        else:
            found[-1] = Part(found[-1].name, key)
    if topic is None or at < len(text):
        raise UnknownField(
            f"'{shorten(text)}' is not a field",
            "write TOPIC.FIELD, such as joint_states.position[joint_1] or tf[cup].translation.z",
        )
    return FieldName(text, "/" + topic["topic"].strip("/"), first, tuple(found))


def ways(message: Message, name: FieldName) -> tuple[Way, ...]:
    """Paths to the numbers of a field: the field itself, or all numbers below it if it is a message.

    Raises:
        UnknownField: a missing or ambiguous field, or brackets on a field that is not an array.
    """
    looked = _Budget()
    holder = message
    steps: list[tuple[Part, Type]] = []
    arrays = [field for field in message.fields if _is_array_of_messages(field.type)]
    # Brackets after the topic select elements of its only array of messages, or of its lists of numbers.
    waiting = name.key
    if waiting is not None and len(arrays) == 1:
        steps.append((Part(arrays[0].name, waiting), arrays[0].type))
        waiting = None
    for part in name.parts:
        inner = _inside(steps[-1][1] if steps else message)
        found = _found(inner, part.name, looked)
        if not found:
            known = [short(message, way) for way in numbers(message)] if inner is message else numbers(inner or message)
            hint = did_you_mean(part.name, known, kind="fields")
            by_name = len(arrays) == 1 or any(field.type == Array(Text(), None) for field in message.fields)
            if inner is message and name.key is None and by_name and not nearest(part.name, known):
                hint = f"select an element with brackets: {name.topic.strip('/')}[{part.name}].FIELD; {hint}"
            raise UnknownField(f"{name.text}: {name.topic} has no field '{part.name}'", hint)
        if len(found) > 1:
            choices = [".".join(field.name for field in path) for _, path in found[:4]]
            raise UnknownField(f"{name.text}: '{part.name}' is in several fields", f"write {any_of(choices)}")
        ((holder, fields),) = found
        steps += [(Part(field.name), field.type) for field in fields]
        if part.key is not None:
            _bracket(steps, part.key, name)
    parts = tuple(part for part, _ in steps)
    ends = list(_ends(steps[-1][1], parts, holder, looked) if steps else _below(message, (), looked))
    if waiting is not None:
        ends = [replace(way, parts=(*way.parts[:-1], Part(way.parts[-1].name, waiting))) for way in ends if way.many]
    if not ends:
        raise UnknownField(f"{name.text} has no number", _hint(message))
    if len(ends) > MAX_WAYS:
        raise UnknownField(f"{name.text} has more than {MAX_WAYS} fields", _hint(message))
    return tuple(ends)


def _hint(message: Message) -> str:
    known = [short(message, way) for way in numbers(message)]
    return f"fields: {listed(known)}" if known else "no numeric fields in this message"


class _Budget:
    """Remaining number of fields to visit."""

    def __init__(self) -> None:
        self._left = MAX_LOOKED_AT

    def spend(self) -> bool:
        self._left -= 1
        return self._left > 0


def _is_array_of_messages(kind: Type) -> bool:
    return isinstance(kind, Array) and isinstance(kind.element, Message)


def _inside(kind: Type) -> Message | None:
    """The message whose fields are searched for a type, or None."""
    if isinstance(kind, Array):
        kind = kind.element
    return kind if isinstance(kind, Message) else None


def _found(message: Message | None, name: str, looked: _Budget) -> list[tuple[Message, tuple[Field, ...]]]:
    """All shortest paths to a field with this name, each with the message that contains it."""
    level: list[tuple[Message, tuple[Field, ...]]] = [] if message is None else [(message, ())]
    for _ in range(MAX_DEPTH):
        found = [(holder, (*steps, field)) for holder, steps in level if (field := holder.field(name)) is not None]
        if found or not level:
            return found
        level = [
            (inner, (*steps, field))
            for holder, steps in level
            for field in holder.fields
            if (inner := _inside(field.type)) is not None and field.name not in _UNINTERESTING and looked.spend()
        ]
    return []


def _bracket(steps: list[tuple[Part, Type]], key: Key, name: FieldName) -> None:
    """Attach brackets to the last array without any: `contacts.force[cup]` selects the contact, not the number."""
    for k in reversed(range(len(steps))):
        part, kind = steps[k]
        if isinstance(kind, Array) and part.key is None:
            steps[k] = (Part(part.name, key), kind)
            return
    raise UnknownField(f"{name.text}: '{steps[-1][0].name}' is not an array")


def _ends(kind: Type, parts: tuple[Part, ...], holder: Message, looked: _Budget) -> Iterator[Way]:
    """The numbers at the end of a path, or below it."""
    inner = _inside(kind)
    if inner is None:
        element = kind.element if isinstance(kind, Array) else kind
        if isinstance(element, Number):
            yield Way(parts, holder, isinstance(kind, Array))
    elif inner.is_time:
        yield Way(parts, holder, is_time=True)
    else:
        yield from _below(inner, parts, looked)


def _below(message: Message, parts: tuple[Part, ...], looked: _Budget) -> Iterator[Way]:
    for field in message.fields:
        if field.name in _UNINTERESTING or not looked.spend():
            continue
        inner = _inside(field.type)
        if inner is not None and inner.is_time:
            continue
        yield from _ends(field.type, (*parts, Part(field.name)), message, looked)


def numbers(message: Message) -> tuple[str, ...]:
    """Names of the numbers in messages of a type, without headers and times; at most a few hundred."""
    return tuple(way.name for way in islice(_below(message, (), _Budget()), 4 * MAX_WAYS))


def short(message: Message, name: str) -> str:
    """The name of a number without its first part, if that is the only array of messages."""
    arrays = [field.name for field in message.fields if _is_array_of_messages(field.type)]
    first, _, rest = name.partition(".")
    return rest if rest and arrays == [first] else name
