"""Hints for errors in a file: the likely unit, the right place of a key, the right form of a value."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, get_args, get_origin

from pydantic import BaseModel

from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean, nearest
from manipcli.core.units import ANGLE, LENGTH, NUMBER
from manipcli.spec.base import Model
from manipcli.spec.quantity import Unit
from manipcli.spec.source import shape
from manipcli.spec.source.tree import Node, ScalarNode

_WORDS = {"yes": "true", "on": "true", "y": "true", "no": "false", "off": "false", "n": "false"}
_SMALLER = (
    (ANGLE, "degrees", "deg", 180.0 / math.pi), (LENGTH, "millimetres", "mm", 1e3), (NUMBER, "percent", "%", 1e2)
)  # fmt: skip


def other_unit(unit: Unit | None, context: dict[str, object], node: Node) -> str | None:
    """Hint for a number out of range that would be in range as degrees, millimetres or percent."""
    most = next((context[key] for key in ("le", "lt", "ge") if key in context), None)
    value = node.value if isinstance(node, ScalarNode) else None
    if not isinstance(most, int | float) or not isinstance(value, int | float) or value * most <= 0:
        return None
    guesses = [
        f"in {what}? write '{value:g} {symbol}'"
        for dimension, what, symbol, size in _SMALLER
        if unit is not None and dimension in unit.dimensions and abs(value) > abs(most) >= abs(value) / size
    ]
    return "; ".join(guesses) or None


def unknown_key(path: Loc, tags: Mapping[int, str], model: type[BaseModel]) -> str | None:
    """Hint for an unknown key: its new name, the block it belongs to, or the nearest known key."""
    key = str(path[-1])
    for kind in shape.at(model, path[:-1], tags):
        if isinstance(kind, type) and issubclass(kind, Model) and key in kind.renamed:
            return f"write `{kind.renamed[key]}`: `{key}` was renamed"
    for k in range(len(path) - 2, 0, -1):
        if isinstance(path[k], str) and key in shape.keys_of(shape.at(model, path[:k], tags)):
            return f"put `{key}` next to `{path[k]}`, not inside it"
    known = shape.keys_of(shape.at(model, path[:-1], tags))
    if len(path) == 1 and key == "include":
        return "put `include: FILE` inside `scene`, `frames` or `steps`"
    top = shape.keys_of([model]) if len(path) == 2 else {}
    inside = [name for name in top if name != path[0] and key in shape.keys_of(shape.at(model, (name,), tags))]
    if len(inside) == 1 and key not in top:
        return f"put `{key}` inside `{inside[0]}`"
    inside = [name for name in known if key in shape.keys_of(shape.at(model, (*path[:-1], name), tags))]
    if 0 < len(inside) <= 3:
        return f"put `{key}` inside {' or '.join(f'`{name}`' for name in inside)}"
    close = nearest(key, known)
    hint = did_you_mean(key, known, kind="known keys")
    return f"{hint} ({close[0]}: {known[close[0]].description})" if close and known[close[0]].description else hint


def to_write(kinds: Sequence[object]) -> str | None:
    """How to write a mapping of these types: `{to: ...}`; for several types, their common required keys."""
    known = shape.keys_of(kinds)
    each = [keys for kind in kinds if (keys := shape.keys_of([kind]))]
    needed = [key for key in known if all(key in keys and keys[key].is_required() for keys in each)]
    if not needed and len(each) == 1:
        needed = list(known)[:1]
    items = (f"{key}: {1 if known[key].annotation is int else '...'}" for key in needed)
    return f"write {{{', '.join(items)}}}" if needed else None


def its_key(node: Node, kinds: Sequence[object]) -> str | None:
    """Hint for a scalar that is a key of the expected mapping: how to write that mapping."""
    known = shape.keys_of(kinds)
    return to_write(kinds) if isinstance(node, ScalarNode) and node.value in known else None


def of_type(kind: str, node: Node, kinds: Sequence[object], *, item: bool) -> str | None:
    """Hint for a value, maybe an `item` of a list, of the wrong type: the YAML that was probably meant."""
    value = node.value if isinstance(node, ScalarNode) else None
    if isinstance(node, ScalarNode) and value is None:
        return "the key has no value"
    if kind == "bool_type" and isinstance(value, str) and value.casefold() in _WORDS:
        return f"YAML 1.2 has only true and false: write {_WORDS[value.casefold()]}"
    if kind in ("float_type", "int_type") and isinstance(value, str):
        return _quoted(value)
    if kind == "tuple_type" and isinstance(value, str) and any(_texts(allowed) == (str, ...) for allowed in kinds):
        return f"write [{value}]"
    if kind == "tuple_type" and isinstance(value, str) and any(_texts(allowed) == (str, str) for allowed in kinds):
        return "write each pair as a list: [[A, B]]" if item else "write a pair as a list: [A, B]"
    if kind == "string_type" and isinstance(value, int | float):
        return "put it in quotes to make it a string"
    return None


def _texts(kind: object) -> tuple[object, ...]:
    """The types of the items of a list, without their metadata."""
    return tuple(get_args(item)[0] if get_origin(item) is Annotated else item for item in get_args(kind))


def _quoted(text: str) -> str | None:
    try:
        float(text)
    except ValueError:
        return "this number has no unit" if text[:1].isdigit() else None
    return f"remove the quotes: {text}"
