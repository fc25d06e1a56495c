"""Bodies that are written once with a `count`: their flat form, one body each, and selections of them.

scene:
  ball: {sphere: {radius: 6 mm}, mass: 1 g, count: 20, inside: cup}      # ball[0] to ball[19]

`ball[*]` is the selection of all of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Final

from pydantic import BaseModel

from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean
from manipcli.spec.scene import MOST, BodySpec
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, child

ALL: Final = "[*]"
_MEMBER: Final = re.compile(r"(.*)\[(\d+)\]", re.DOTALL)


def members(name: str, count: int) -> tuple[str, ...]:
    """The names of the bodies of a `count`: `ball[0]`, `ball[1]`, ..."""
    return tuple(f"{name}[{k}]" for k in range(count))


def flat_scene(scene: Mapping[str, BodySpec]) -> dict[str, BodySpec]:
    """The bodies of a scene by name, each `count` as that many bodies; the same bodies where there is no `count`."""
    flat: dict[str, BodySpec] = {}
    for name, body in scene.items():
        if body.count is None:
            flat[name] = body
        else:
            one = body.model_copy(update={"count": None})
            flat |= dict.fromkeys(members(name, body.count), one)
    return flat


def group(name: str, scene: Mapping[str, BodySpec]) -> str | None:
    """The body with a `count` that a body of the flat scene belongs to; None for any other name."""
    found = _MEMBER.fullmatch(name)
    owner = "" if found is None else str(found[1])
    return owner if owner in scene and scene[owner].count is not None else None


def written(loc: Loc, scene: Mapping[str, BodySpec]) -> Loc:
    """A location in the flat scene as it is in the file: `scene.ball[3].inside` is `scene.ball.inside`."""
    match loc:
        case ("scene", str() as name, *rest) if (owner := group(name, scene)) is not None:
            return ("scene", owner, *rest)
    return loc


def selections(names: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """The selections of bodies by name, `ball[*]`, each with its members in the order of `names`."""
    found: dict[str, list[str]] = {}
    for name in names:
        if (match := _MEMBER.fullmatch(name)) is not None:
            found.setdefault(f"{match[1]}{ALL}", []).append(name)
    return {name: tuple(inside) for name, inside in found.items()}


def selected(spec: object) -> tuple[str, ...]:
    """The selections that the values of a spec name, without duplicates: of `ball[*]/top`, `ball[*]`."""
    if isinstance(spec, str):
        owner = spec.partition("/")[0]
        return (owner,) if owner.endswith(ALL) else ()
    if isinstance(spec, BaseModel):
        values: Iterable[object] = (getattr(spec, name) for name in type(spec).model_fields)
    else:
        values = spec if isinstance(spec, tuple | list) else ()
    return tuple(dict.fromkeys(name for value in values for name in selected(value)))


def with_member(spec: object, selection: str, name: str) -> object:
    """A spec with the name of one body instead of a selection."""
    if isinstance(spec, str):
        owner, slash, part = spec.partition("/")
        return f"{name}{slash}{part}" if owner == selection else spec
    if isinstance(spec, BaseModel):
        values = {key: getattr(spec, key) for key in type(spec).model_fields}
        changed = {key: with_member(value, selection, name) for key, value in values.items()}
        changed = {key: value for key, value in changed.items() if value is not values[key]}
        return spec.model_copy(update=changed) if changed else spec
    if isinstance(spec, tuple):
        items = tuple(with_member(value, selection, name) for value in spec)
        return spec if all(a is b for a, b in zip(items, spec, strict=True)) else items
    return spec


def one_of_many(name: str, names: Iterable[str]) -> tuple[str, str | None] | None:
    """Message and hint for a name of several bodies where one is expected, `ball` or `ball[*]`; None for others."""
    known = selections(names)
    many = known.get(name) or known.get(f"{name}{ALL}")
    if many is not None:
        first = f"name one of them, '{many[0]}'"
        hint = f"{first}; in a condition: `all_of`, `any_of` or `at_least` with '{many[0].rpartition('[')[0]}{ALL}'"
        return f"'{name}' is {len(many)} bodies, expected one", hint
    if name.endswith(ALL):
        return f"'{name}' selects no body: no body has this name and a `count`", did_you_mean(
            name, known, kind="selections"
        )
    return None


def flat_names(scene: MappingNode) -> dict[str, Node]:
    """The names of the bodies of a tree `scene:`, selections after their members, each with the node of its body."""
    found: dict[str, Node] = {}
    for name, entry in scene.entries.items():
        count = child(entry.node, "count")
        number = count.value if isinstance(count, ScalarNode) else None
        if isinstance(number, int) and 0 < number <= MOST:
            found |= dict.fromkeys((*members(name, number), f"{name}{ALL}"), entry.node)
        else:
            found[name] = entry.node
    return found
