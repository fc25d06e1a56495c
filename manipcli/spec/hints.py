"""Hints for who wrote a file: the unit that was meant, the place of a key, the value as it should be written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import get_args

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
    """The hint where a plain number beyond what is taken lies within it as degrees, millimetres or percent."""
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
    """The key's new name, the block around it that knows it, or the nearest of the keys that are known there."""
    key = str(path[-1])
    for kind in shape.at(model, path[:-1], tags):
        if isinstance(kind, type) and issubclass(kind, Model) and key in kind.renamed:
            return f"write `{kind.renamed[key]}`, as `{key}` is called now"
    for k in range(len(path) - 2, 0, -1):
        if key in shape.keys_of(shape.at(model, path[:k], tags)):
            return f"`{key}` stands beside `{path[k]}`, not below it"
    known = shape.keys_of(shape.at(model, path[:-1], tags))
    inside = [name for name in known if key in shape.keys_of(shape.at(model, (*path[:-1], name), tags))]
    if 0 < len(inside) <= 3:
        return f"`{key}` stands below {' or '.join(f'`{name}`' for name in inside)}"
    close = nearest(key, known)
    hint = did_you_mean(key, known, kind="known keys")
    return f"{hint} ({close[0]}: {known[close[0]].description})" if close and known[close[0]].description else hint


def to_write(kinds: Sequence[object]) -> str | None:
    """How a mapping of these types is written: `{to: ...}`; of several, what all of them need."""
    known = shape.keys_of(kinds)
    each = [keys for kind in kinds if (keys := shape.keys_of([kind]))]
    needed = [key for key in known if all(key in keys and keys[key].is_required() for keys in each)]
    if not needed and len(each) == 1:
        needed = list(known)[:1]
    items = (f"{key}: {1 if known[key].annotation is int else '...'}" for key in needed)
    return f"write {{{', '.join(items)}}}" if needed else None


def its_key(node: Node, kinds: Sequence[object]) -> str | None:
    """Where a word stands alone that is a key of the mapping that may stand there: how that is written."""
    known = shape.keys_of(kinds)
    return to_write(kinds) if isinstance(node, ScalarNode) and node.value in known else None


def of_type(kind: str, node: Node, kinds: Sequence[object], *, item: bool) -> str | None:
    """Where a value, maybe an `item` of a list, is of none of the `kinds` that may stand there: the YAML that was
    meant."""
    value = node.value if isinstance(node, ScalarNode) else None
    if isinstance(node, ScalarNode) and value is None:
        return "the key has no value"
    if kind == "bool_type" and isinstance(value, str) and value.casefold() in _WORDS:
        return f"YAML 1.2 knows true and false alone: write {_WORDS[value.casefold()]}"
    if kind in ("float_type", "int_type") and isinstance(value, str):
        return _quoted(value)
    if kind == "tuple_type" and isinstance(value, str) and any(get_args(one) == (str, ...) for one in kinds):
        return f"write [{value}]"
    if kind == "tuple_type" and isinstance(value, str) and any(get_args(one) == (str, str) for one in kinds):
        return "a pair is a list of its own: [[A, B]]" if item else "a pair is a list: [A, B]"
    if kind == "string_type" and isinstance(value, int | float):
        return "quotes make a text of it"
    return None


def _quoted(text: str) -> str | None:
    try:
        float(text)
    except ValueError:
        return "this number has no unit" if text[:1].isdigit() else None
    return f"remove the quotes: {text}"
