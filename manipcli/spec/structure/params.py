"""Declared parameters of a sub-task: `params: {object: {type: body}, height: {type: length, default: 5 cm}}`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Final

from manipcli.core.errors import Place
from manipcli.core.text import did_you_mean, escape, listed
from manipcli.core.units import ANGLE, FORCE, LENGTH, MASS, NUMBER, SPEED, TIME, Dimension, UnitError, to_si
from manipcli.spec.expression import INDEX, NAME, quantity_of
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode, child, shown

QUANTITIES: Final[Mapping[str, Dimension]] = {
    "number": NUMBER, "length": LENGTH, "angle": ANGLE, "time": TIME, "speed": SPEED, "force": FORCE, "mass": MASS,
}  # fmt: skip
NAMES: Final = ("body", "frame", "joint", "pose", "controller", "text")
"""Types whose values are words; a `body` must be in the scene, the others are checked where they are used."""
TYPES: Final = (*NAMES, *QUANTITIES, "count", "bool", "position", "any")
"""`count`: a whole number; `position`: three lengths; `any`: also lists and mappings."""
KEYS: Final = ("type", "default", "description")


@dataclass(frozen=True, slots=True)
class Wrong(Exception):
    """A faulty declaration or value, at its node."""

    number: int
    node: Node
    message: str
    hint: str | None = None


@dataclass(frozen=True, slots=True)
class Param:
    """A declared parameter; `default` is not computed yet, None without one."""

    name: str
    type: str
    place: Place
    default: Node | None


def declared(block: Node | None, report: Callable[[str, Wrong], None]) -> list[Param]:
    """The parameters that a sub-task declares; faulty ones are reported with their name and have no type."""
    if block is None:
        return []
    if not isinstance(block, MappingNode):
        hint = "write `params: {object: {type: body}}`"
        report("", Wrong(266, block, f"expected names with their types, not {shown(block)}", hint))
        return []
    found: list[Param] = []
    for name, entry in block.entries.items():
        try:
            kind = _type_of(name, entry.node, entry.key_place)
        except Wrong as wrong:
            report(name, wrong)
            kind = ""
        found.append(Param(name, kind, entry.key_place, child(entry.node, "default")))
    return found


def _type_of(name: str, node: Node, place: Place) -> str:
    if not NAME.fullmatch(name) or name == INDEX:
        hint = "use letters, digits and '_'" if name != INDEX else f"`${INDEX}` is the number of a round"
        raise Wrong(266, ScalarNode(None, place), f"'{escape(name)}' is not a valid parameter name", hint)
    if not isinstance(node, MappingNode):
        value = node.value if isinstance(node, ScalarNode) else None
        hint = f"write `{{type: {value}}}`" if value in TYPES else "write `{type: length, default: 5 cm}`"
        raise Wrong(266, node, f"expected a mapping with `type`, not {shown(node)}", hint)
    for key, entry in node.entries.items():
        if key not in KEYS:
            near = did_you_mean(key, KEYS, kind="keys of a parameter")
            raise Wrong(266, ScalarNode(None, entry.key_place), f"unknown key '{escape(key)}'", near)
    kind = node.get("type")
    value = kind.value if isinstance(kind, ScalarNode) else None
    if kind is None:
        raise Wrong(266, node, "`type` is missing", f"types: {', '.join(TYPES)}")
    if value not in TYPES:
        near = did_you_mean(str(value), TYPES, kind="types")
        raise Wrong(266, kind, f"unknown type {shown(kind)}, expected one of {listed(TYPES, most=20)}", near)
    return str(value)


def check(param: Param, node: Node, bodies: Collection[str]) -> None:
    """Checks a computed value.

    Args:
        param: the declaration.
        node: the value.
        bodies: names of the scene.

    Raises:
        Wrong: the value has another type, or names no body.
    """
    value = node.value if isinstance(node, ScalarNode) else None
    kind = param.type
    origin = f"`{param.name}` is declared at {param.place}"
    if kind == "any" and value is None and isinstance(node, ScalarNode):
        raise Wrong(268, node, "expected a value", origin)
    if kind == "any":
        return
    if kind in QUANTITIES:
        _check_quantity(node, value, QUANTITIES[kind], origin)
    elif kind == "position":
        items = node.items if isinstance(node, SequenceNode) else ()
        if len(items) != 3:
            raise Wrong(268, node, f"expected a position [x, y, z], not {shown(node)}", origin)
        for item in items:
            _check_quantity(item, item.value if isinstance(item, ScalarNode) else None, LENGTH, origin)
    elif kind == "bool" and not isinstance(value, bool):
        raise Wrong(268, node, f"expected true or false, not {shown(node)}", origin)
    elif kind == "count" and (not isinstance(value, int) or isinstance(value, bool)):
        raise Wrong(268, node, f"expected a whole number, not {shown(node)}", origin)
    elif kind in NAMES:
        if not isinstance(value, str):
            what = "a text" if kind == "text" else f"the name of a {kind}"
            raise Wrong(268, node, f"expected {what}, not {shown(node)}", origin)
        if kind == "body" and bodies and value.partition("/")[0] not in bodies:
            near = did_you_mean(value, bodies, kind="bodies")
            raise Wrong(
                268, node, f"there is no body '{escape(value)}' in the scene", f"{near}; {origin}" if near else origin
            )


def _check_quantity(node: Node, value: object, dimension: Dimension, origin: str) -> None:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return
    if not isinstance(value, str):
        raise Wrong(268, node, f"expected {dimension.name}, not {shown(node)}", origin)
    try:
        to_si(value, dimension, read=quantity_of)
    except UnitError as error:
        hint = f"{error.hint}; {origin}" if error.hint else origin
        raise Wrong(268, node, error.cause, hint) from None
