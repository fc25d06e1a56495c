"""Expressions of xacro, computed from their syntax tree: a small part of Python that can reach nothing.

Descriptions are data. What is not listed here is refused: no lambda, no attribute but the keys of loaded data and a few
methods of text and mappings, no name that begins with two underscores, and every result has a bounded size.
"""

from __future__ import annotations

import ast
import math
import operator
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Final

from manipcli.core.text import did_you_mean
from manipcli.model.bounds import BoundName, bounds, raised

MAX_EXPRESSION: Final = 10_000
MAX_INTEGER: Final = 2**1024
MAX_EXPONENT: Final = 64

Value = object
_BINARY: Final[dict[type[ast.operator], Callable[..., Value]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_UNARY: Final[dict[type[ast.unaryop], Callable[..., Value]]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
}
_COMPARE: Final[dict[type[ast.cmpop], Callable[..., Value]]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
}
_METHODS: Final[dict[type, frozenset[str]]] = {
    str: frozenset(
        {"split", "strip", "lstrip", "rstrip", "lower", "upper", "startswith", "endswith", "join", "replace"}
    ),
    dict: frozenset({"get", "keys", "values", "items"}),
    list: frozenset({"index", "count"}),
}


class Refused(Exception):
    """An expression asks for something that descriptions may not do; `hint` says what to do instead."""

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        self.hint = hint
        super().__init__(message)


class Beyond(Refused):
    """A bound is met; `hint` says which and how it is raised."""

    def __init__(self, message: str, bound: BoundName) -> None:
        super().__init__(message, hint=raised(bound))


def size_of(value: Value) -> int:
    """Characters and items in `value` through nesting, counted no further than the bound + 1."""
    limit = bounds().value_size
    total = 0
    stack = [value]
    while stack and total <= limit:
        item = stack.pop()
        total += 1
        if isinstance(item, str):
            total += len(item)
        elif isinstance(item, dict):
            stack.extend(list(dict.values(item))[: limit + 1])
            stack.extend(list(dict.keys(item))[: limit + 1])
        elif isinstance(item, list | tuple | set | frozenset):
            stack.extend(list.__iter__(item) if isinstance(item, list) else item)
    return total


def bounded(value: Value) -> Value:
    """`value`, if it is small enough.

    Raises:
        Refused: a result too large.
    """
    if isinstance(value, bool | float) or value is None:
        return value
    if isinstance(value, int):
        if not -MAX_INTEGER < value < MAX_INTEGER:
            raise Refused("an integer of this size is not allowed")
    elif size_of(value) > bounds().value_size:
        raise too_large("a value")
    return value


def too_large(what: str) -> Beyond:
    return Beyond(f"{what} of more than {bounds().value_size} characters or items is not allowed", "value_size")


def math_symbols() -> dict[str, Value]:
    """The constants and functions of `math` whose cost does not grow with their argument."""
    costly = {"factorial", "comb", "perm", "prod", "lcm", "gcd", "isqrt", "dist", "fsum", "sumprod"}
    return {name: value for name, value in vars(math).items() if not name.startswith("_") and name not in costly}


def python_symbols() -> dict[str, Value]:
    """The built-in functions that expressions may call."""

    def bounded_range(*ends: int) -> list[int]:
        steps = range(*ends)
        if len(steps) > bounds().value_size:
            raise too_large("a range")
        return list(steps)

    def bounded_list(function: Callable[..., Value]) -> Callable[..., Value]:
        # A Value may be a number; zip, map and their like answer that with the TypeError that becomes a finding.
        return lambda *values: bounded(list(function(*(bounded(value) for value in values))))  # type: ignore[call-overload]

    def text(value: Value = "") -> str:
        return str(bounded(value))

    def apply(function: Callable[..., Value], *values: Iterator[Value]) -> Value:
        return bounded([bounded(function(*items)) for items in zip(*values, strict=False)])

    kept = (float, int, bool, len, min, max, round, abs, all, any, sum, divmod, isinstance, ord, dict, tuple, set)
    symbols: dict[str, Value] = {function.__name__: function for function in kept}
    listed = (list, sorted, zip, enumerate, reversed)
    symbols |= {function.__name__: bounded_list(function) for function in listed}
    return symbols | {"range": bounded_range, "str": text, "map": apply, "True": True, "False": False, "None": None}


class Evaluator:
    """Computes expressions; one object serves one expansion and counts its operations."""

    def __init__(self) -> None:
        self._left = bounds().operations

    def __call__(self, text: str, symbols: Mapping[str, Value]) -> Value:
        """The value of `text`.

        Raises:
            Refused: not allowed, or too costly.
            NameError, SyntaxError, TypeError, ArithmeticError, LookupError, ValueError: as in Python.
        """
        if len(text) > MAX_EXPRESSION:
            raise Refused(f"an expression of {len(text)} characters is not allowed")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Python's own doubts about a text (`1if x`) are no one's concern here
            tree = ast.parse(text.strip(), mode="eval")
        return self._value(tree.body, symbols)

    def _value(self, node: ast.expr, names: Mapping[str, Value]) -> Value:
        self._left -= 1
        if self._left < 0:
            raise Beyond("the expressions of the description compute too much", "operations")
        compute = getattr(self, "_" + type(node).__name__.lower(), None)
        if compute is None:
            raise Refused(f"'{ast.unparse(node)[:80]}': {type(node).__name__} is not allowed in an expression")
        return bounded(compute(node, names))

    def _constant(self, node: ast.Constant, names: Mapping[str, Value]) -> Value:
        if isinstance(node.value, bytes) or node.value is ...:
            raise Refused("only numbers, text, True, False and None are constants")
        return node.value

    def _name(self, node: ast.Name, names: Mapping[str, Value]) -> Value:
        if node.id.startswith("__"):
            raise Refused(f"name '{node.id}' is not allowed")
        try:
            return names[node.id]
        except KeyError:
            raise NameError(f"name '{node.id}' is not defined") from None

    def _binop(self, node: ast.BinOp, names: Mapping[str, Value]) -> Value:
        left, right = self._value(node.left, names), self._value(node.right, names)
        if type(node.op) not in _BINARY:
            raise Refused(f"operator {type(node.op).__name__} is not allowed")
        numbers = isinstance(left, int | float) and isinstance(right, int | float)
        if isinstance(node.op, ast.Mod | ast.Pow) and not numbers:
            raise Refused("only numbers have a remainder or a power")
        if isinstance(node.op, ast.Pow) and isinstance(right, int | float) and abs(right) > MAX_EXPONENT:
            raise Refused(f"an exponent beyond {MAX_EXPONENT} is not allowed")
        if isinstance(node.op, ast.Mult):
            most = bounds().value_size
            for one, other in ((left, right), (right, left)):
                if isinstance(one, int) and not isinstance(other, int | float) and size_of(other) * one > most:
                    raise too_large("a value")
        return _BINARY[type(node.op)](left, right)

    def _unaryop(self, node: ast.UnaryOp, names: Mapping[str, Value]) -> Value:
        if type(node.op) not in _UNARY:
            raise Refused(f"operator {type(node.op).__name__} is not allowed")
        return _UNARY[type(node.op)](self._value(node.operand, names))

    def _boolop(self, node: ast.BoolOp, names: Mapping[str, Value]) -> Value:
        value: Value = None
        for operand in node.values:
            value = self._value(operand, names)
            if bool(value) != isinstance(node.op, ast.And):
                break
        return value

    def _compare(self, node: ast.Compare, names: Mapping[str, Value]) -> Value:
        left = self._value(node.left, names)
        for kind, comparator in zip(node.ops, node.comparators, strict=True):
            right = self._value(comparator, names)
            if not _COMPARE[type(kind)](left, right):
                return False
            left = right
        return True

    def _ifexp(self, node: ast.IfExp, names: Mapping[str, Value]) -> Value:
        return self._value(node.body if self._value(node.test, names) else node.orelse, names)

    def _list(self, node: ast.List, names: Mapping[str, Value]) -> Value:
        return [self._value(item, names) for item in node.elts]

    def _tuple(self, node: ast.Tuple, names: Mapping[str, Value]) -> Value:
        return tuple(self._value(item, names) for item in node.elts)

    def _dict(self, node: ast.Dict, names: Mapping[str, Value]) -> Value:
        if any(key is None for key in node.keys):
            raise Refused("** is not allowed in an expression")
        keys = [self._value(key, names) for key in node.keys if key is not None]
        return dict(zip(keys, (self._value(value, names) for value in node.values), strict=True))

    def _subscript(self, node: ast.Subscript, names: Mapping[str, Value]) -> Value:
        container = self._value(node.value, names)
        if not isinstance(container, str | list | tuple | dict):
            raise Refused(f"'{ast.unparse(node.value)[:80]}' has no items")
        index = self._index(node.slice, names)
        try:
            # An index of the wrong kind is Python's to refuse: its TypeError becomes a finding.
            return container[index]  # type: ignore[call-overload,index]
        except LookupError:
            near = did_you_mean(str(index), map(str, list(container)[:100])) if isinstance(container, dict) else None
            message = f"'{ast.unparse(node.value)[:80]}' has no item {str(index)[:80]!r}"
            raise LookupError(f"{message} ({near})" if near else message) from None

    def _index(self, node: ast.expr, names: Mapping[str, Value]) -> Value:
        if isinstance(node, ast.Slice):
            ends = [None if end is None else self._value(end, names) for end in (node.lower, node.upper, node.step)]
            return slice(*ends)
        return self._value(node, names)

    def _attribute(self, node: ast.Attribute, names: Mapping[str, Value]) -> Value:
        if node.attr.startswith("__"):
            raise Refused(f"attribute '{node.attr}' is not allowed")
        owner = self._value(node.value, names)
        if isinstance(owner, dict) and node.attr in owner:
            return owner[node.attr]
        for kind, methods in _METHODS.items():
            if isinstance(owner, kind) and node.attr in methods:
                return self._method(owner, kind, node.attr)
        if not isinstance(owner, dict):
            raise Refused(f"attribute '{node.attr}' is not allowed")
        raise NameError(f"name '{ast.unparse(node)[:80]}' is not defined")

    def _method(self, owner: Value, kind: type, name: str) -> Callable[..., Value]:
        method: Callable[..., Value] = getattr(kind, name)

        def call(*arguments: Value) -> Value:
            if name == "replace":
                grown = (size_of(owner) + 1) * size_of(arguments[1] if len(arguments) > 1 else "")
                if grown > bounds().value_size * 64:
                    raise too_large("a replacement")
            if name == "join":
                bounded(list(arguments))
                if size_of(owner) * size_of(list(arguments)) > bounds().value_size * 64:
                    raise too_large("a text")
            result = method(owner, *arguments)
            # These three methods give views, which mypy cannot know from a name.
            return list(result) if name in {"keys", "values", "items"} else result  # type: ignore[call-overload]

        return call

    def _call(self, node: ast.Call, names: Mapping[str, Value]) -> Value:
        function = self._value(node.func, names)
        if not callable(function) or any(isinstance(item, ast.Starred) for item in node.args):
            raise Refused(f"'{ast.unparse(node)[:80]}' cannot be called")
        if any(keyword.arg is None for keyword in node.keywords):
            raise Refused("** is not allowed in an expression")
        positional = [self._value(item, names) for item in node.args]
        named = {str(keyword.arg): self._value(keyword.value, names) for keyword in node.keywords}
        return function(*positional, **named)

    def _listcomp(self, node: ast.ListComp, names: Mapping[str, Value]) -> Value:
        found: list[Value] = []
        for scope in self._scopes(node.generators, _Scope(names, {})):
            found.append(self._value(node.elt, scope))
            if len(found) > bounds().value_size:
                raise too_large("a list")
        return found

    def _generatorexp(self, node: ast.GeneratorExp, names: Mapping[str, Value]) -> Value:
        return self._listcomp(ast.ListComp(elt=node.elt, generators=node.generators), names)

    def _dictcomp(self, node: ast.DictComp, names: Mapping[str, Value]) -> Value:
        scopes = self._scopes(node.generators, _Scope(names, {}))
        return {self._value(node.key, scope): self._value(node.value, scope) for scope in scopes}

    def _scopes(self, generators: list[ast.comprehension], scope: _Scope) -> Iterator[_Scope]:
        if not generators:
            yield scope
            return
        first, rest = generators[0], generators[1:]
        items = self._value(first.iter, scope)
        if not isinstance(items, str | list | tuple | dict):
            raise Refused(f"'{ast.unparse(first.iter)[:80]}' cannot be gone through")
        for item in items:
            inner = _Scope(scope, _targets(first.target, item))
            if all(self._value(test, inner) for test in first.ifs):
                yield from self._scopes(rest, inner)


class _Scope(Mapping[str, Value]):
    """The variables of a comprehension before the names around it."""

    def __init__(self, outer: Mapping[str, Value], inner: dict[str, Value]) -> None:
        self._outer = outer
        self._inner = inner

    def __getitem__(self, name: str) -> Value:
        return self._inner[name] if name in self._inner else self._outer[name]

    def __iter__(self) -> Iterator[str]:
        return iter({**dict(self._outer), **self._inner})

    def __len__(self) -> int:
        return len(self._outer) + len(self._inner)


def _targets(target: ast.expr, item: Value) -> dict[str, Value]:
    if isinstance(target, ast.Name):
        return {target.id: item}
    if isinstance(target, ast.Tuple) and isinstance(item, list | tuple) and len(item) == len(target.elts):
        found: dict[str, Value] = {}
        for part, value in zip(target.elts, item, strict=True):
            found |= _targets(part, value)
        return found
    raise Refused("a comprehension names its variables plainly")
