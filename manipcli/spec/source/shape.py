"""Types allowed at a path of a pydantic model, for messages: known keys and expected values."""

from __future__ import annotations

import types
from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, Union, get_args, get_origin

from pydantic import BaseModel, Tag
from pydantic.fields import FieldInfo
from typing_extensions import TypeAliasType

from manipcli.core.errors import Loc


def alternatives(annotation: object) -> list[tuple[object, str | None]]:
    """The members of a union, flattened, each with its tag; any other type is its own single member."""
    if isinstance(annotation, TypeAliasType):
        return alternatives(annotation.__value__)
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *metadata = get_args(annotation)
        tag = next((item.tag for item in metadata if isinstance(item, Tag)), None)
        return [(member, tag or below) for member, below in alternatives(inner)]
    if origin in (Union, types.UnionType):
        return [pair for member in get_args(annotation) for pair in alternatives(member)]
    return [(annotation, None)]


def at(model: type[BaseModel], path: Loc, tags: Mapping[int, str]) -> list[object]:
    """The types allowed at `path`.

    Args:
        model: model of the whole file.
        path: keys and indices.
        tags: pydantic's name of the chosen union member, by depth of the path.
    """
    found: list[tuple[object, str | None]] = [(model, None)]
    for depth, part in enumerate(path):
        found = [pair for kind, _ in _chosen(found, tags.get(depth)) for pair in _below(kind, part)]
    return [kind for kind, _ in _chosen(found, tags.get(len(path)))]


def keys_of(kinds: Sequence[object]) -> dict[str, FieldInfo]:
    """The keys of these types, with their fields; of lists, those of an item, as one mapping needs no list."""
    own = {
        field.alias or name: field
        for kind in kinds
        if isinstance(kind, type) and issubclass(kind, BaseModel)
        for name, field in kind.model_fields.items()
        if not field.exclude
    }
    items = [item for kind in kinds if _is_list(kind) for item, _ in alternatives(get_args(kind)[0])]
    return own or (keys_of(items) if items else {})


def is_of_fixed_length(kinds: Sequence[object]) -> bool:
    """Whether all lists among the types have the same fixed length."""
    return (
        not any(map(_is_list, kinds)) and len({len(get_args(kind)) for kind in kinds if get_origin(kind) is tuple}) == 1
    )


def takes_any_key(kinds: Sequence[object]) -> bool:
    """Whether one of the types is a mapping with user-defined keys."""
    return any(get_origin(kind) is dict for kind in kinds)


def _chosen(found: list[tuple[object, str | None]], tag: str | None) -> list[tuple[object, str | None]]:
    if tag is None:
        return found
    return [(kind, own) for kind, own in found if own == tag or _called(kind, tag)] or found


def _called(kind: object, tag: str) -> bool:
    origin = get_origin(kind)
    if origin is not None:
        return isinstance(origin, type) and tag.startswith(f"{origin.__name__}[")
    if not isinstance(kind, type):
        return False
    if not issubclass(kind, BaseModel):
        return kind.__name__ == tag
    word = kind.model_fields.get("type")
    literal = word is not None and get_origin(word.annotation) is Literal and tag in get_args(word.annotation)
    return literal or kind.__name__ == tag


def _is_list(kind: object) -> bool:
    """Whether it is a list of any length."""
    return get_origin(kind) is list or (get_origin(kind) is tuple and get_args(kind)[-1:] == (Ellipsis,))


def _below(kind: object, part: str | int) -> list[tuple[object, str | None]]:
    origin, arguments = get_origin(kind), get_args(kind)
    if isinstance(kind, type) and origin is None and issubclass(kind, BaseModel):
        field = keys_of([kind]).get(str(part))
        return [] if field is None else alternatives(field.annotation)
    if origin is dict and isinstance(part, str):
        return alternatives(arguments[1])
    if origin in (tuple, list) and isinstance(part, int):
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            return alternatives(arguments[0])
        return alternatives(arguments[min(part, len(arguments) - 1)])
    if _is_list(kind):  # a single mapping instead of a list of one
        return [pair for item, _ in alternatives(arguments[0]) for pair in _below(item, part)]
    return []
