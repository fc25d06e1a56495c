"""Conditions on parameters, which the loader decides: `if: {equal: [$color, red]}`, `if: $use_left`.

`equal` compares two values: numbers with units as quantities, to 1 part in 1e9; everything else as text. `all`, `any`
and `not` combine it, also with conditions that are asked in the run: of these, what is decided is left out.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Final

from manipcli.core.text import escape, nearest
from manipcli.core.units import NUMBER, Quantity, UnitError
from manipcli.spec.expression import names_used, quantity_of
from manipcli.spec.source.tree import MappingNode, Node, Scalar, ScalarNode, SequenceNode, child, shown

EQUAL: Final = "equal"
ROUNDING: Final = 1e-9
"""Relative difference of equal quantities."""


class Undecidable(Exception):
    """A faulty condition on parameters."""

    def __init__(self, node: Node, message: str, hint: str | None = None) -> None:
        self.node = node
        self.message = message
        self.hint = hint
        super().__init__(message)


def without_parameter(condition: Node, names: Collection[str]) -> tuple[ScalarNode, str] | None:
    """A value of an `equal` without parameters that is the name of one: probably its `$` is missing."""
    values = child(condition, EQUAL)
    if not isinstance(values, SequenceNode) or names_used(values):
        return None
    words = ((v, v.value) for v in values.items if isinstance(v, ScalarNode) and isinstance(v.value, str))
    return next(((node, word) for node, word in words if word in names), None)


def decided(condition: Node) -> bool | Node:
    """Whether a computed condition holds; if it depends on the run, what is left to ask then.

    Raises:
        Undecidable: `equal` does not have two values that can be compared.
    """
    if isinstance(condition, ScalarNode) and isinstance(condition.value, bool):
        return condition.value
    if not isinstance(condition, MappingNode) or not condition.entries:
        return condition
    if len(condition.entries) > 1:
        if EQUAL in condition.entries:
            raise Undecidable(condition, "`equal` takes a list of two values", "write `equal: [$color, red]`")
        return condition
    ((word, entry),) = condition.entries.items()
    if word != EQUAL and nearest(word, [EQUAL]):
        raise Undecidable(condition, f"unknown condition '{escape(word)}'", f"did you mean '{EQUAL}'?")
    if word == EQUAL:
        return _equal(entry.node)
    if word == "not":
        inner = decided(entry.node)
        return not inner if isinstance(inner, bool) else condition.with_node(word, inner)
    if word in ("all", "any") and isinstance(entry.node, SequenceNode):
        return _combined(condition, word, entry.node)
    return condition


def _combined(condition: MappingNode, word: str, members: SequenceNode) -> bool | Node:
    left: list[Node] = []
    ends = word == "any"
    found = False
    for member in members.items:
        inner = decided(member)
        if not isinstance(inner, bool):
            left.append(inner)
        elif inner is ends:
            found = True
    if found:
        return ends
    if not left:
        return not ends if members.items else condition
    return condition.with_node(word, SequenceNode(tuple(left), members.place))


def _equal(node: Node) -> bool:
    values = node.items if isinstance(node, SequenceNode) else ()
    if len(values) != 2:
        message = f"`equal` compares two values, not {shown(node)}"
        raise Undecidable(node, message, "write `equal: [$color, red]`")
    for value in values:
        if not isinstance(value, ScalarNode) or value.value is None:
            raise Undecidable(value, f"`equal` compares numbers, words and true or false, not {shown(value)}")
    first, second = (value.value for value in values if isinstance(value, ScalarNode))
    if isinstance(first, bool) != isinstance(second, bool):
        message = f"cannot compare {shown(values[0])} with {shown(values[1])}: only one of them is true or false"
        raise Undecidable(values[1], message, "write true and false without quotes")
    if isinstance(first, bool):
        return first is second
    a, b = _quantity(first), _quantity(second)
    if a is None or b is None:
        return a is b and first == second
    if a.dimension != b.dimension:
        message = f"cannot compare {a.dimension.name} with {b.dimension.name}"
        raise Undecidable(values[1], message, "give both the same kind of unit")
    return math.isclose(a.value, b.value, rel_tol=ROUNDING, abs_tol=0.0)


def _quantity(value: Scalar) -> Quantity | None:
    if isinstance(value, str):
        try:
            return quantity_of(value)
        except UnitError:
            return None
    return Quantity(float(value or 0.0), NUMBER)
