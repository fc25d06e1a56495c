"""Types as rosapi describes them, rosapi_msgs/TypeDef: fields, examples and constants."""

from __future__ import annotations

import re
from typing import Final

from manipcli.live.command import Values
from manipcli.record.definition import Array, Message, Number, Text, Type
from manipcli.record.json_message import BadMessage, definition
from manipcli.record.schemas import DEFINITIONS

_CONSTANT: Final = re.compile(r"\S+\s+([A-Z]\w*)\s*=\s*(.*\S)")


def typedefs(kind: str) -> Values:
    """`{"typedefs": [...]}` of a type, that type first.

    Raises:
        BadMessage: an unknown type.
    """
    try:
        root = definition(kind)
    except KeyError:
        raise BadMessage(f"unknown type '{kind[:80]}'") from None
    found: dict[str, Values] = {}

    def add(message: Message) -> None:
        if message.name in found:
            return
        elements = [field.type.element if isinstance(field.type, Array) else field.type for field in message.fields]
        sizes = [(field.type.length or 0) if isinstance(field.type, Array) else -1 for field in message.fields]
        constants = _CONSTANT.findall(DEFINITIONS.get(message.name, ""))
        found[message.name] = {
            "type": message.name,
            "fieldnames": [field.name for field in message.fields],
            "fieldtypes": [_name(element) for element in elements],
            "fieldarraylen": sizes,
            "examples": [_example(element, size) for element, size in zip(elements, sizes, strict=True)],
            "constnames": [name for name, _ in constants],
            "constvalues": [value for _, value in constants],
        }
        for element in elements:
            if isinstance(element, Message):
                add(element)

    add(root)
    return {"typedefs": [*found.values()]}


def _name(kind: Type) -> str:
    return kind.name if isinstance(kind, Number | Message) else "string"


def _example(kind: Type, size: int) -> str:
    if size >= 0:
        return "[]"
    if isinstance(kind, Number):
        return {"bool": "False", "float32": "0.0", "float64": "0.0"}.get(kind.name, "0")
    return "" if isinstance(kind, Text) else "{}"
