"""Where each value of a task comes from: its file, line and column, an override, a default, or parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, Literal, get_args

from manipcli.core.prose import amount, point
from manipcli.core.units import NUMBER, UnitError, parse_quantity
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.expression import Scope, names_used
from manipcli.spec.quantity import Unit
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode, child, plain

Kind = Literal["file", "override", "default"]
NOTHING: Final[tuple[object, ...]] = (None, (), {})
"""Defaults without a value."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter in an expression: its value, where that is, and the expression that it was computed from."""

    name: str
    value: str
    place: str
    expression: str | None


@dataclass(frozen=True, slots=True)
class Origin:
    """A value and where it comes from.

    Attributes:
        path: in its block: `approach.distance`.
        value: readable, with its unit.
        kind: `file`, `override` or `default`.
        place: `FILE:LINE:COLUMN`, or the option of an override; "" for a default.
        expression: with parameters, as written; None without.
        parameters: those of the expression, and those that they were computed from.
    """

    path: str
    value: str
    kind: Kind
    place: str = ""
    expression: str | None = None
    parameters: tuple[Parameter, ...] = ()

    def __str__(self) -> str:
        if self.kind == "default":
            return f"{self.path} {self.value} (default)"
        if self.expression is None:
            return f"{self.path} {self.value} ({self.place})"
        first = self.parameters[0] if len(self.parameters) == 1 else None
        if first is not None and self.expression.strip() == f"${first.name}":
            return f"{self.path} {self.value} (= {self.expression.strip()}, {first.place})"
        whence = [
            f"${p.name} = {p.value}{f' = {p.expression}' * bool(p.expression)}, {p.place}" for p in self.parameters
        ]
        return f"{self.path} {self.value} (= {self.expression.strip()}, {self.place}; {'; '.join(whence)})"


@dataclass(frozen=True, slots=True)
class Origins:
    """Reads the values of blocks: `scope` has the parameters that are known there; `robot` the units of joints."""

    scope: Scope | None
    robot: RobotModel

    def block(self, model: Model, node: Node | None, path: str = "", *, given: bool = False) -> Iterator[Origin]:
        """The values of a block, in the order of its fields; with `given`, without defaults."""
        short = node is not None and not isinstance(node, MappingNode)
        for name, field in type(model).model_fields.items():
            value, key = getattr(model, name), field.alias or name
            below = child(node, key) if isinstance(node, MappingNode) else None
            if short and name in model.model_fields_set:
                below = node
            if below is None and (given or value in NOTHING):
                continue
            unit = unit_of(field.annotation, field.metadata)
            yield from self.value(value, below, _join(path, key), unit, given=given)

    def value(
        self, value: object, node: Node | None, path: str, unit: str | None = None, *, given: bool = False
    ) -> Iterator[Origin]:
        """A value of any kind, with the values in it."""
        if isinstance(value, Model):
            yield from self.block(value, node, path, given=given)
        elif isinstance(value, Mapping):
            for key, each in value.items():
                own = self.joint_unit(str(key)) if unit is None else unit
                yield from self.value(each, node and child(node, key), _join(path, str(key)), own, given=given)
        elif isinstance(value, tuple) and any(isinstance(item, Model | tuple | Mapping) for item in value):
            items = isinstance(node, SequenceNode) and len(node.items) == len(value)
            for k, each in enumerate(value):
                below = child(node, k) if items and node is not None else node
                yield from self.value(each, below, f"{path}[{k}]", unit, given=given)
        elif isinstance(value, tuple) and isinstance(node, SequenceNode) and not _is_plain(node):
            for k, (each, below) in enumerate(zip(value, node.items, strict=False)):
                yield from self.value(each, below, f"{path}[{k}]", unit)
        else:
            yield self.origin(path, readable_value(value, unit, node), node)

    def origin(self, path: str, value: str, node: Node | None) -> Origin:
        if node is None:
            return Origin(path, value, "default")
        kind: Kind = "file" if node.place.line > 0 else "override"
        if not isinstance(node, ScalarNode) or node.written is None:
            return Origin(path, value, kind, str(node.place))
        return Origin(path, value, kind, str(node.place), node.written, tuple(self.parameters(node)))

    def parameters(self, node: ScalarNode, above: tuple[str, ...] = ()) -> Iterator[Parameter]:
        """The parameters of an expression, in the order of their names, each followed by those of its own."""
        scope = self.scope
        for name in sorted(names_used(ScalarNode(node.written, node.place))):
            found = None if scope is None or name in above else scope.nodes.get(name)
            if scope is None or found is None:
                continue
            written = found.written if isinstance(found, ScalarNode) else None
            text = readable_value(plain(found), None, found)
            yield Parameter(name, text, str(found.place), written)
            # A local parameter was computed where its block is used, from the parameters there.
            if written is not None and isinstance(found, ScalarNode) and name not in scope.local:
                yield from self.parameters(found, (*above, name))

    def joint_unit(self, name: str) -> str | None:
        """The unit of a joint; None if the robot has no joint of this name."""
        return next((joint.unit for joint in self.robot.joints if joint.name == name), None)


def unit_of(annotation: object, metadata: object = ()) -> str | None:
    """The SI unit of the numbers in a type; None if it has none, or several."""
    found = {dimension.symbol for unit in _units(annotation, metadata) for dimension in unit.dimensions}
    return found.pop() if len(found) == 1 else None


def _units(annotation: object, metadata: object = ()) -> Iterator[Unit]:
    yield from (
        each for each in (*_tuple(metadata), *_tuple(getattr(annotation, "__metadata__", ()))) if isinstance(each, Unit)
    )
    for inner in get_args(annotation):
        yield from _units(inner)


def _tuple(items: object) -> tuple[object, ...]:
    return tuple(items) if isinstance(items, list | tuple) else ()


def readable_value(value: object, unit: str | None, node: Node | None = None) -> str:
    """A value as text; numbers with `unit`, else with the unit in which the file gives them."""
    if unit is None and isinstance(node, ScalarNode) and isinstance(node.value, str):
        try:
            quantity = parse_quantity(node.value)
        except UnitError:
            pass
        else:
            return amount(quantity.value, quantity.dimension.symbol)
    if isinstance(value, bool) or value is None:
        return {True: "true", False: "false", None: "nothing"}[value]
    if isinstance(value, int | float):
        return f"{value}" if isinstance(value, int) and not unit else amount(value, unit or NUMBER.symbol)
    if isinstance(value, list | tuple):
        numbers = [item for item in value if isinstance(item, int | float) and not isinstance(item, bool)]
        if numbers and len(numbers) == len(value):
            return point(numbers, unit or "")
        return f"[{', '.join(readable_value(item, unit) for item in value)}]"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {readable_value(each, unit)}' for key, each in value.items())}}}"
    return _text(value) if isinstance(value, str) else str(value)


def _text(value: str) -> str:
    """A word in quotes; a quantity without."""
    try:
        quantity = parse_quantity(value)
    except UnitError:
        return f"'{value}'"
    return f"'{value}'" if quantity.dimension == NUMBER else amount(quantity.value, quantity.dimension.symbol)


def _is_plain(node: SequenceNode) -> bool:
    """Whether all items of a list are written in it, as values."""
    return all(
        isinstance(item, ScalarNode) and item.written is None and item.place.file == node.place.file
        for item in node.items
    )


def _join(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key
