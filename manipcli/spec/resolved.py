"""A spec as YAML with defaults, SI numbers and ids written out. Loading it gives an equal spec."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping

from pydantic import BaseModel

from manipcli.core.errors import Loc
from manipcli.spec.expression import escaped
from manipcli.spec.source.tree import Plain
from manipcli.spec.structure.nest import Nesting
from manipcli.spec.task import TaskSpec

_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*")
# The second set is only reserved in YAML 1.1, which other readers of a log may use.
_RESERVED = frozenset({"null", "true", "false"}) | frozenset({"yes", "no", "on", "off", "y", "n"})
_UNSAFE = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")
_WIDTH = 100


def resolved(spec: BaseModel, expressions: Mapping[Loc, Plain] | None = None) -> str:
    """The YAML text, with keys in the order of the model and of the file.

    Args:
        spec: the spec to write.
        expressions: expressions with `$name` to write instead of their values, by path; and the parameters of blocks of
            a task, see `retry.expressions`.
    """
    data = _data(spec, escape=isinstance(spec, TaskSpec))
    params: dict[int, Plain] = {}
    for path, text in (expressions or {}).items():
        if path[0] == "blocks" and isinstance(path[1], int):
            params[path[1]] = text
        else:
            data = _with(data, path, text)
    assert isinstance(data, dict)
    if isinstance(spec, TaskSpec):
        steps, blocks = data["steps"], data.pop("blocks", [])
        if spec.blocks and isinstance(steps, list) and isinstance(blocks, list):
            data["steps"] = Nesting(steps, spec.blocks, blocks, params).items()
    return yaml_text(data)


def yaml_text(data: dict[str, Plain]) -> str:
    """Plain data as YAML text."""
    return "".join(f"{line}\n" for line in _lines(data))


def plain_data(spec: BaseModel) -> dict[str, Plain]:
    """A spec as plain data with defaults, without null keys whose default is null."""
    data = _data(spec, escape=False)
    assert isinstance(data, dict)
    return data


def as_written(spec: BaseModel) -> str:
    """The YAML text without defaults: only values set in a file or by `model_copy`."""
    data = _data(spec, escape=isinstance(spec, TaskSpec), stated=True)
    assert isinstance(data, dict)
    return yaml_text(data)


def _data(value: object, *, escape: bool, stated: bool = False) -> Plain:
    """Plain data without null keys whose default is null; with `stated`, without all unset keys."""
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        chosen = value.model_fields_set if stated else fields.keys()
        pairs = ((field.alias or name, field, getattr(value, name)) for name, field in fields.items() if name in chosen)
        return {
            key: _data(v, escape=escape, stated=stated)
            for key, field, v in pairs
            if not (v is None and field.default is None)
        }
    if isinstance(value, dict):
        return {str(key): _data(v, escape=escape, stated=stated) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [_data(v, escape=escape, stated=stated) for v in value]
    if isinstance(value, str):
        return escaped(value) if escape else str(value)
    if value is None or isinstance(value, bool | int | float):
        return value
    raise TypeError(f"a spec cannot hold {type(value).__name__}")


def _with(data: Plain, path: Loc, text: Plain) -> Plain:
    """The data with `text` instead of the value at `path`, or of the block it abbreviates."""
    if not path:
        return text
    first, rest = path[0], path[1:]
    if isinstance(data, dict):
        return {key: _with(value, rest, text) if key == first else value for key, value in data.items()}
    if isinstance(data, list):
        return [_with(value, rest, text) if k == first else value for k, value in enumerate(data)]
    return data


def _lines(data: dict[str, Plain]) -> list[str]:
    lines: list[str] = []
    for key, value in data.items():
        name = yaml_word(key)
        short = f"{name}: {inline(value)}"
        if len(short) <= _WIDTH or not isinstance(value, dict | list):
            lines.append(short)
        elif isinstance(value, dict):
            lines.append(f"{name}:")
            lines.extend(f"  {line}" for line in _lines(value))
        else:
            lines.append(f"{name}:")
            lines.extend(f"  {line}" for line in _items(value))
    return lines


def _items(items: list[Plain]) -> list[str]:
    lines: list[str] = []
    for item in items:
        inner = _lines(item) if isinstance(item, dict) and len(inline(item)) > _WIDTH else [inline(item)]
        lines.append(f"- {inner[0]}")
        lines.extend(f"  {line}" for line in inner[1:])
    return lines


def inline(value: Plain) -> str:
    """A value on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{yaml_word(key)}: {inline(v)}" for key, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(inline, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if value is None:
        return "null"
    if isinstance(value, str):
        return yaml_word(value)
    return number_text(value)


def number_text(value: int | float) -> str:
    """A number in YAML, with all its digits; YAML 1.1 reads 1e-05, which has no point, as a string."""
    if math.isinf(value):
        return ".inf" if value > 0.0 else "-.inf"
    mantissa, exponent, power = repr(value).partition("e")
    return f"{mantissa}.0e{power}" if exponent and "." not in mantissa else f"{mantissa}{exponent}{power}"


def yaml_word(text: str) -> str:
    """A plain word unquoted; a text that YAML could misread in double quotes."""
    if _WORD.fullmatch(text) and text.casefold() not in _RESERVED:
        return text
    return _UNSAFE.sub(lambda match: f"\\u{ord(match.group()):04x}", json.dumps(text, ensure_ascii=False))
