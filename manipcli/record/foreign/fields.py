"""What a user writes for a number in a log: `TOPIC.FIELD`, `joint_states.position[joint_1]`, `tf[cup].translation.z`.

Brackets pick elements of an array: by number, or by a name that the element bears or that stands beside it (`name`,
`joint_names`); `[a,b]` several, `[a+b]` the one that bears both. A field that is not there by itself is looked for
below: `tf[cup].translation.z` is `tf.transforms[cup].transform.translation.z`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

from manipcli.core.text import any_of, did_you_mean, listed, nearest, shorten
from manipcli.record.definition import MAX_DEPTH, Array, Field, Message, Number, Text, Type

MAX_WAYS = 64
"""Fields that one word may stand for."""
MAX_LOOKED_AT = 20_000
"""Fields that are looked at for one word: types may be nested so that there are more than anybody can count."""
_NAME = re.compile(r"(?P<topic>[^.\[\]]+)")
_PART = re.compile(r"\.(?P<name>\w+)|\[(?P<key>[^\[\]]*)\]")
_UNINTERESTING = frozenset({"header", "time_from_start"})
"""Left out where a whole message is asked for."""


@dataclass(frozen=True, slots=True)
class Key:
    """What is in brackets: `words`, one of which an element must have; of a word `a+b` it must have every part."""

    words: tuple[str, ...]

    def takes(self, names: tuple[str, ...], number: int, count: int) -> bool:
        """Whether an element with these names is meant, the one with this number of so many."""
        known = {*names, str(number), str(number - count)}
        return any(word in known or set(word.split("+")) <= known for word in self.words)


@dataclass(frozen=True, slots=True)
class Part:
    """One field on the way to the wanted number; `key` where only some of its elements are meant."""

    name: str
    key: Key | None = None


class UnknownField(ValueError):
    """A field that is not there, and a hint."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True, slots=True)
class FieldName:
    """A field as it was written: `topic` with its leading `/`; `key`: brackets right behind the topic."""

    text: str
    topic: str
    key: Key | None
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class Way:
    """A field that is there: all parts from the message down, and the type that holds it.

    `many`: it is a list of numbers; `is_time`: it is a time, in seconds.
    """

    parts: tuple[Part, ...]
    holder: Message
    many: bool = False
    is_time: bool = False

    @property
    def name(self) -> str:
        """The parts without what is in brackets."""
        return ".".join(part.name for part in self.parts)


def parse_field(text: str) -> FieldName:
    """
    Raises:
        UnknownField: it is not written like one.
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
            f"'{shorten(text)}' is no field",
            "write TOPIC.FIELD, as joint_states.position[joint_1] or tf[cup].translation.z",
        )
    return FieldName(text, "/" + topic["topic"].strip("/"), first, tuple(found))


def ways(message: Message, name: FieldName) -> tuple[Way, ...]:
    """The numbers that a field of a topic of this type stands for: one, or all below it where it is no number.

    Raises:
        UnknownField: it has no such field, several could be meant, or brackets stand where there is no array.
    """
    looked = _Budget()
    holder = message
    steps: list[tuple[Part, Type]] = []
    arrays = [one for one in message.fields if _is_array_of_messages(one.type)]
    # Brackets behind the topic mean the elements of the one array that it is, or else those of its lists of numbers.
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
            by_name = len(arrays) == 1 or any(one.type == Array(Text(), None) for one in message.fields)
            if inner is message and name.key is None and by_name and not nearest(part.name, known):
                hint = f"brackets pick an element: {name.topic.strip('/')}[{part.name}].FIELD; {hint}"
            raise UnknownField(f"{name.text}: {name.topic} has no field '{part.name}'", hint)
        if len(found) > 1:
            choices = [".".join(one.name for one in each) for _, each in found[:4]]
            raise UnknownField(f"{name.text}: several fields are called '{part.name}'", f"say {any_of(choices)}")
        ((holder, fields),) = found
        steps += [(Part(one.name), one.type) for one in fields]
        if part.key is not None:
            _bracket(steps, part.key, name)
    parts = tuple(part for part, _ in steps)
    ends = list(_ends(steps[-1][1], parts, holder, looked) if steps else _below(message, (), looked))
    if waiting is not None:
        ends = [replace(way, parts=(*way.parts[:-1], Part(way.parts[-1].name, waiting))) for way in ends if way.many]
    if not ends:
        raise UnknownField(f"{name.text}: there is no number", _hint(message))
    if len(ends) > MAX_WAYS:
        raise UnknownField(f"{name.text} stands for more than {MAX_WAYS} fields", _hint(message))
    return tuple(ends)


def _hint(message: Message) -> str:
    known = [short(message, way) for way in numbers(message)]
    return f"fields: {listed(known)}" if known else "none of its fields is a number"


class _Budget:
    """How many more fields may be looked at."""

    def __init__(self) -> None:
        self._left = MAX_LOOKED_AT

    def spend(self) -> bool:
        self._left -= 1
        return self._left > 0


def _is_array_of_messages(kind: Type) -> bool:
    return isinstance(kind, Array) and isinstance(kind.element, Message)


def _inside(kind: Type) -> Message | None:
    """The message in which fields of a type are looked for."""
    if isinstance(kind, Array):
        kind = kind.element
    return kind if isinstance(kind, Message) else None


def _found(message: Message | None, name: str, looked: _Budget) -> list[tuple[Message, tuple[Field, ...]]]:
    """Every shortest way to a field of that name, each with the message that holds it."""
    level: list[tuple[Message, tuple[Field, ...]]] = [] if message is None else [(message, ())]
    for _ in range(MAX_DEPTH):
        found = [(holder, (*steps, one)) for holder, steps in level if (one := holder.field(name)) is not None]
        if found or not level:
            return found
        level = [
            (inner, (*steps, one))
            for holder, steps in level
            for one in holder.fields
            if (inner := _inside(one.type)) is not None and one.name not in _UNINTERESTING and looked.spend()
        ]
    return []


def _bracket(steps: list[tuple[Part, Type]], key: Key, name: FieldName) -> None:
    """Gives brackets to the last array that has none: `contacts.force[cup]` means the contact and not the number."""
    for k in reversed(range(len(steps))):
        part, kind = steps[k]
        if isinstance(kind, Array) and part.key is None:
            steps[k] = (Part(part.name, key), kind)
            return
    raise UnknownField(f"{name.text}: '{steps[-1][0].name}' is no array")


def _ends(kind: Type, parts: tuple[Part, ...], holder: Message, looked: _Budget) -> Iterator[Way]:
    """The numbers at the end of a way, or below it."""
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
    for one in message.fields:
        if one.name in _UNINTERESTING or not looked.spend():
            continue
        inner = _inside(one.type)
        if inner is not None and inner.is_time:
            continue
        yield from _ends(one.type, (*parts, Part(one.name)), message, looked)


def numbers(message: Message) -> tuple[str, ...]:
    """The names of the numbers in messages of a type, without headers and times; a few hundred at most."""
    return tuple(way.name for way in islice(_below(message, (), _Budget()), 4 * MAX_WAYS))


def short(message: Message, name: str) -> str:
    """The name of a number without its first part where the message is one array: it is meant anyway."""
    arrays = [one.name for one in message.fields if _is_array_of_messages(one.type)]
    first, _, rest = name.partition(".")
    return rest if rest and arrays == [first] else name
