"""Expressions with parameters and units in a task file: `$tilt`, `$a / 2`, `2 * $tilt + 5 deg`.

The grammar (parameters are its only names, so it cannot run code):

    sum     = product (("+" | "-") product)*
    product = sign (("*" | "/") sign)*
    sign    = ("+" | "-")* value
    value   = number [unit] | "$" name | "(" sum ")"

A unit belongs to the number before it: `6 rad/s / 2` is 3 rad/s. `$$` writes a dollar sign. A quantity may be
arithmetic without parameters: `30 deg + 5 deg`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from manipcli.core.errors import Diagnostic, Loc, Place
from manipcli.core.text import did_you_mean, escape, nearest, shorten
from manipcli.core.units import (
    NUMBER,
    NUMBER_PATTERN,
    UNIT_PATTERN,
    Quantity,
    UnitError,
    format_quantity,
    parse_quantity,
)
from manipcli.spec.source.tree import Entry, MappingNode, Node, Scalar, ScalarNode, dotted, mapped, shown

_REFERENCE = re.compile(r"(?<!\$)(?:\$\$)*\$(?!\$)(?=[A-Za-z_{])")
NAME = re.compile(r"[A-Za-z_]\w*")
"""Valid parameter names."""
_NAMES = re.compile(r"(?<!\$)(?:\$\$)*\$(?!\$)([A-Za-z_]\w*)")
_ALONE = re.compile(r"\s*\$([A-Za-z_]\w*)\s*")
_TOKEN = re.compile(
    rf"\s*(?:(?P<name>\$[A-Za-z_]\w*)|(?P<quantity>{NUMBER_PATTERN}(?:\s*{UNIT_PATTERN})?)|(?P<sign>[-+*/()]))"
)
_DEEPEST = 50
INDEX: Final = "index"
"""Parameter of the number of a round, from 0."""

Params = Mapping[str, Scalar]


@dataclass(frozen=True, slots=True)
class ExpressionError(Exception):
    """An expression without a value. `unknown`: a parameter is unknown; `uncut`: it cannot be tokenised."""

    cause: str
    hint: str | None = None
    unknown: bool = False
    uncut: bool = False


def is_expression(text: str) -> bool:
    """Whether `text` refers to a parameter."""
    return _REFERENCE.search(text) is not None


def evaluate(text: str, params: Params) -> Scalar:
    """The value of a parameter or expression: an SI text, or a number if it has no unit.

    `params` must hold every name that `text` uses.

    Raises:
        ExpressionError: syntax error, dimensions that cannot be added, division by zero.
    """
    alone = _ALONE.fullmatch(text)
    if alone is not None:
        return params[alone.group(1)]
    value = _Parser(text, params).whole()
    if not math.isfinite(value.value):
        raise ExpressionError(f"'{shorten(text)}' exceeds the largest number, 1.8e308")
    if value.dimension == NUMBER:
        return int(value.value) if value.value.is_integer() and abs(value.value) < 2**53 else value.value
    return format_quantity(value.value, value.dimension)


def quantity_of(text: str) -> Quantity:
    """A number with a unit, or the result of arithmetic on such numbers: `30 deg + 5 deg`.

    Raises:
        UnitError: as `parse_quantity`; or the arithmetic has no value.
    """
    try:
        return parse_quantity(text)
    except UnitError as error:
        plain = error
    try:
        parser = _Parser(text, {})
        kinds = [kind for kind, _ in parser.tokens]
        value = parser.whole() if kinds.count("quantity") > 1 and "name" not in kinds else None
    except ExpressionError as error:
        raise (plain if error.uncut else UnitError(error.cause, hint=error.hint)) from None
    if value is None:
        raise plain
    if not math.isfinite(value.value):
        raise UnitError(f"'{shorten(text)}' exceeds the largest number, 1.8e308")
    return value


class _Parser:
    """Recursive descent over one text."""

    def __init__(self, text: str, params: Params) -> None:
        self.text = text
        self.params = params
        self.tokens = list(self._cut())
        self.position = 0
        self.depth = 0

    def _cut(self) -> list[tuple[str, str]]:
        tokens: list[tuple[str, str]] = []
        position, end = 0, len(self.text.rstrip())
        while position < end:
            match = _TOKEN.match(self.text, position)
            if match is None or match.lastgroup is None:
                rest = shorten(self.text[position:].strip(), width=20)
                hint = "write `$name`, or arithmetic: 2 * $tilt + 5 deg; write `$$` for a plain dollar sign"
                if rest.startswith(("==", "!=")):
                    hint = "write `{equal: [A, B]}`, or `{not: {equal: [A, B]}}`"
                raise ExpressionError(f"cannot compute '{shorten(self.text)}': unexpected '{rest}'", hint, uncut=True)
            tokens.append((match.lastgroup, match.group(match.lastgroup)))
            position = match.end()
        return tokens

    def whole(self) -> Quantity:
        try:
            value = self.sum()
        except UnitError as error:
            raise ExpressionError(error.cause, error.hint) from None
        if self.position < len(self.tokens):
            raise ExpressionError(
                f"cannot compute '{shorten(self.text)}': unexpected '{self.tokens[self.position][1]}'"
            )
        return value

    def taken(self, *signs: str) -> str | None:
        """Consumes and returns the next token if it is in `signs`."""
        if self.position < len(self.tokens) and self.tokens[self.position][1] in signs:
            self.position += 1
            return self.tokens[self.position - 1][1]
        return None

    def sum(self) -> Quantity:
        self.depth += 1
        if self.depth > _DEEPEST:
            raise ExpressionError(f"more than {_DEEPEST} nested parentheses")
        value = self.product()
        while (sign := self.taken("+", "-")) is not None:
            other = self.product()
            if other.dimension != value.dimension:
                raise ExpressionError(f"cannot add {value.dimension.name} and {other.dimension.name}")
            value = Quantity(value.value + (other.value if sign == "+" else -other.value), value.dimension)
        self.depth -= 1
        return value

    def product(self) -> Quantity:
        value = self.sign()
        while (sign := self.taken("*", "/")) is not None:
            other = self.sign()
            if sign == "*":
                value = Quantity(value.value * other.value, value.dimension * other.dimension)
            elif other.value == 0.0:
                raise ExpressionError(f"'{shorten(self.text)}' divides by zero")
            else:
                value = Quantity(value.value / other.value, value.dimension / other.dimension)
        return value

    def sign(self) -> Quantity:
        factor = 1.0
        while (sign := self.taken("+", "-")) is not None:
            factor = -factor if sign == "-" else factor
        value = self.value()
        return Quantity(factor * value.value, value.dimension)

    def value(self) -> Quantity:
        if self.taken("(") is not None:
            value = self.sum()
            if self.taken(")") is None:
                raise ExpressionError(f"a '(' is not closed in '{shorten(self.text)}'")
            return value
        kind, token = self.tokens[self.position] if self.position < len(self.tokens) else ("end", "")
        self.position += 1
        if kind == "quantity":
            return parse_quantity(token)
        if kind == "name":
            return self.quantity(token[1:])
        raise ExpressionError(f"a value is missing in '{shorten(self.text)}'")

    def quantity(self, name: str) -> Quantity:
        value = self.params[name]
        if isinstance(value, str):
            return quantity_of(value)
        if value is None or isinstance(value, bool):
            raise ExpressionError(f"the parameter '${name}' is not a number")
        return Quantity(float(value), NUMBER)


def substitute(root: Node, *, refused: Iterable[Place] = ()) -> tuple[Node, Scope]:
    """The task with all expressions computed outside of `steps:` and `blocks:`, and the scope of its parameters.

    A parameter may use the parameters above it in `params:`. `refused`: places of invalid values.
    """
    scope = Scope(refused)
    if not isinstance(root, MappingNode):
        return root, scope
    block = root.get("params")
    if isinstance(block, MappingNode):
        scope.below = list(block.entries)
        entries: dict[str, Entry] = {}
        for name, entry in block.entries.items():
            node = mapped(entry.node, scope.computed, ("params", name))
            scope.below.remove(name)
            entries[name] = Entry(entry.key_place, node)
            scope.declare(name, node)
        root = root.with_entry("params", Entry(root.entries["params"].key_place, MappingNode(entries, block.place)))
    done = {
        key: entry
        if key in ("params", "steps", "blocks")
        else Entry(entry.key_place, mapped(entry.node, scope.computed, (key,)))
        for key, entry in root.entries.items()
    }
    return MappingNode(done, root.place), scope


class Scope:
    """The parameters at one place of a task, and what was found while computing with them.

    Attributes:
        nodes: values of the parameters: scalars, lists or mappings.
        isolated: whether it holds only what a sub-task declares.
        local: names whose values are given in `each:` or `with:`, not in the task's `params:`.
        lost: parameters without a value, already reported.
        below: names that are not computed yet, beginning with the current one.
        used: names of the task's parameters that were used; shared with inner scopes, as the next four are.
        elsewhere: names in `each:` and `with:` of any scope.
        findings: errors of expressions.
        refused: places of invalid values.
        unknown: places of values that stay unknown.
    """

    def __init__(self, refused: Iterable[Place] = ()) -> None:
        self.nodes: dict[str, Node] = {}
        self.isolated = False
        self.local: frozenset[str] = frozenset()
        self.lost: frozenset[str] = frozenset()
        self.below: list[str] = []
        self.used: set[str] = set()
        self.elsewhere: set[str] = set()
        self.findings: list[Diagnostic] = []
        self.refused = set(refused)
        self.unknown: set[Place] = set()

    def declare(self, name: str, node: Node) -> None:
        """Adds a computed parameter; a list or a mapping in `params:` was refused."""
        if isinstance(node, ScalarNode) and node.place not in self.refused:
            self.nodes[name] = node
        else:
            self.lost |= {name}

    def inner(
        self, given: Mapping[str, Node], *, lost: Iterable[str] = (), isolated: bool = False, below: Iterable[str] = ()
    ) -> Scope:
        """A scope with more parameters; with `isolated`, with no others."""
        scope = Scope()
        scope.isolated = isolated or self.isolated
        scope.nodes = {**given} if isolated else {**self.nodes, **given}
        scope.local = frozenset(given) if isolated else self.local.union(given)
        scope.lost = frozenset(lost) if isolated else self.lost.difference(given).union(lost)
        scope.below = list(below)
        scope.used, scope.findings, scope.elsewhere = self.used, self.findings, self.elsewhere
        scope.elsewhere.update(given)
        scope.refused, scope.unknown = self.refused, self.unknown
        return scope

    @property
    def names(self) -> tuple[str, ...]:
        """All names that are known here."""
        return tuple(dict.fromkeys((*self.nodes, *self.below, *sorted(self.lost))))

    def computed(self, node: ScalarNode, path: Loc) -> Node:
        """The value of a scalar; with a finding, the scalar unchanged."""
        if not isinstance(node.value, str) or "$" not in node.value:
            return node
        if not is_expression(node.value):
            return replace(node, value=node.value.replace("$$", "$"))
        names = _NAMES.findall(node.value)
        self.used.update(name for name in names if name not in self.local)
        if self.lost.intersection(names):
            self.refused.add(node.place)
            self.unknown.add(node.place)
            return node
        try:
            self.in_order(names)
            alone = _ALONE.fullmatch(node.value)
            found = self.nodes[alone.group(1)] if alone is not None else None
            if found is not None and not isinstance(found, ScalarNode):
                return found
            given = next((self.nodes[name].place for name in names if name in self.local), None)
            return ScalarNode(evaluate(node.value, self.scalars(names)), node.place, written=node.value, given=given)
        except ExpressionError as error:
            code = "TASK203" if error.unknown else "TASK211"
            self.findings.append(Diagnostic(code, f"{dotted(path)}: {error.cause}", node.place, hint=error.hint))
            self.refused.add(node.place)
            return node

    def scalars(self, names: Iterable[str]) -> dict[str, Scalar]:
        """The values of these parameters.

        Raises:
            ExpressionError: one of them is a list or a mapping.
        """
        values: dict[str, Scalar] = {}
        for name in names:
            node = self.nodes[name]
            if not isinstance(node, ScalarNode):
                raise ExpressionError(f"the parameter '${name}' is {shown(node)}", alone(name, node))
            values[name] = node.value
        return values

    def in_order(self, names: Sequence[str]) -> None:
        """Checks that all names are parameters; inside `params:`, that they are defined above."""
        for name in names:
            if self.below and name == self.below[0]:
                raise ExpressionError(f"the parameter '${name}' depends on itself", "give it a value")
            if name in self.below:
                cause = f"the parameter '${name}' is used before it is defined"
                raise ExpressionError(cause, f"move '{escape(name)}' above '{escape(self.below[0])}'", unknown=True)
            if name not in self.nodes:
                known = [param for param in self.names if param not in self.below[:1]]
                hint = did_you_mean(name, known, kind="params") if self.names else no_params(name)
                if self.isolated:
                    known_here = f"a sub-task knows only its own `params`: declare '{name}' there, give it under `with`"
                    hint = did_you_mean(name, known, kind="params") if nearest(name, known) else known_here
                if name in self.elsewhere and not self.isolated:
                    hint = f"`${name}` is known only inside its `repeat` or sub-task"
                if name == INDEX:
                    hint = f"`${INDEX}` counts the rounds of a `repeat`: it is known only inside its `steps`"
                raise ExpressionError(f"unknown parameter '${name}'", hint, unknown=True)


def alone(name: str, node: Node) -> str:
    """Hint for a list or a mapping within an expression."""
    hint = f"use ${name} alone: it has no value that can be computed with"
    return f"{hint}, and `.` does not select a key" if isinstance(node, MappingNode) else hint


def names_used(node: Node) -> frozenset[str]:
    """Names of the parameters in the expressions of a tree that is not computed yet."""
    found: set[str] = set()

    def note(scalar: ScalarNode, _: Loc) -> Node:
        if isinstance(scalar.value, str) and "$" in scalar.value:
            found.update(_NAMES.findall(scalar.value))
        return scalar

    mapped(node, note)
    return frozenset(found)


def no_params(name: str) -> str:
    """Hint for a task that uses a parameter and declares none."""
    word = escape(name)
    return f"the task has no parameters: add `params: {{{word}: ...}}`, then write ${word} where it is used"


def escaped(text: str) -> str:
    """`text` with dollar signs escaped, so that `substitute` returns it unchanged."""
    return text.replace("$", "$$")
