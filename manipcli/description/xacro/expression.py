"""Safe evaluation of xacro expressions on their syntax tree, in a small subset of Python.

Everything that is not listed here is rejected: lambdas, attributes other than the keys of loaded data and a few methods
of text and mappings, names that begin with two underscores. Every result has a bounded size.
"""

from __future__ import annotations

import ast
import operator
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from typing import Final, cast

from manipcli.core.text import did_you_mean
from manipcli.description.bounds import bounds
from manipcli.description.xacro.values import (
    Beyond,
    Clock,
    Held,
    Refused,
    Value,
    bounded,
    instance_of,
    size_of,
    too_large,
)

MAX_EXPRESSION: Final = 10_000
MAX_EXPONENT: Final = 64
MAX_SHIFT: Final = 1024

_DIRECTIVE: Final = re.compile(r"%(?:%|(?:\(\w+\))?[-+ #0]*\d{0,3}(?:\.\d{0,3})?[diouxXeEfFgGcrs])")

_BINARY: Final[dict[type[ast.operator], Callable[..., Value]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_OF_INTEGERS: Final[dict[type[ast.operator], Callable[..., Value]]] = {
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
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
        {"split", "rsplit", "strip", "lstrip", "rstrip", "lower", "upper", "title", "capitalize", "startswith"}
        | {"endswith", "join", "replace", "find", "rfind", "index", "count", "isdigit", "isalpha"}
    ),
    dict: frozenset({"get", "keys", "values", "items"}),
    list: frozenset({"index", "count"}),
}


class Evaluator:
    """Evaluates the expressions of one expansion and counts the operations.

    Each operation acts on values of bounded size and checks the clock first, so the total time is bounded.
    """

    def __init__(self, clock: Clock | None = None) -> None:
        self._left = bounds().operations
        self._clock = clock or Clock()

    def __call__(self, text: str, symbols: Mapping[str, Value]) -> Value:
        """The value of `text`.

        Raises:
            Refused: not allowed, or a bound is exceeded.
            NameError, SyntaxError, TypeError, ArithmeticError, LookupError, ValueError: as in Python.
        """
        if len(text) > MAX_EXPRESSION:
            raise Refused(f"expression has {len(text)} characters; at most {MAX_EXPRESSION} are allowed")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # syntax warnings of Python (`1if x`)
            tree = ast.parse(text.strip(), mode="eval")
        return self._value(tree.body, symbols)

    def _value(self, node: ast.expr, names: Mapping[str, Value]) -> Value:
        self._left -= 1
        if self._left < 0:
            raise Beyond("the expressions of the description take too many operations", "operations")
        self._clock.look()
        compute = getattr(self, "_" + type(node).__name__.lower(), None)
        if compute is None:
            raise Refused(f"'{ast.unparse(node)[:80]}': {type(node).__name__} is not allowed in an expression")
        return bounded(compute(node, names))

    def _constant(self, node: ast.Constant, names: Mapping[str, Value]) -> Value:
        if isinstance(node.value, bytes) or node.value is ...:
            raise Refused("only numbers, text, True, False and None are allowed as constants")
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
        if type(node.op) in _OF_INTEGERS:
            return _of_integers(node.op, left, right)
        if type(node.op) not in _BINARY:
            raise Refused(f"operator {type(node.op).__name__} is not allowed")
        if isinstance(node.op, ast.Mod) and isinstance(left, str):
            return _formatted(left, right)
        numbers = isinstance(left, int | float) and isinstance(right, int | float)
        if isinstance(node.op, ast.Mod | ast.Pow) and not numbers:
            raise Refused("% and ** are allowed only for numbers")
        if isinstance(node.op, ast.Pow) and isinstance(right, int | float) and abs(right) > MAX_EXPONENT:
            raise Refused(f"an exponent above {MAX_EXPONENT} is not allowed")
        if isinstance(node.op, ast.Mult):
            most = bounds().value_size
            for factor, other in ((left, right), (right, left)):
                if isinstance(factor, int) and not isinstance(other, int | float) and size_of(other) * factor > most:
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
        return self._each(node.elts, names)

    def _tuple(self, node: ast.Tuple, names: Mapping[str, Value]) -> Value:
        return tuple(self._each(node.elts, names))

    def _each(self, nodes: list[ast.expr], names: Mapping[str, Value]) -> list[Value]:
        held = Held()
        found: list[Value] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                several = held.add(self._value(node.value, names))
                if not isinstance(several, str | list | tuple | dict | set):
                    raise Refused(f"'{ast.unparse(node)[:80]}': only a list can be unpacked with *")
                found += several
            else:
                found.append(held.add(self._value(node, names)))
        return found

    def _dict(self, node: ast.Dict, names: Mapping[str, Value]) -> Value:
        if any(key is None for key in node.keys):
            raise Refused("** is not allowed in an expression")
        keys = self._each([key for key in node.keys if key is not None], names)
        return dict(zip(keys, self._each(node.values, names), strict=True))

    def _subscript(self, node: ast.Subscript, names: Mapping[str, Value]) -> Value:
        container = self._value(node.value, names)
        if not isinstance(container, str | list | tuple | dict):
            raise Refused(f"'{ast.unparse(node.value)[:80]}' has no items")
        index = self._index(node.slice, names)
        try:
            # An index of the wrong type raises a TypeError, which becomes a finding.
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
            # These three methods return views, which mypy cannot infer from the name.
            return list(result) if name in {"keys", "values", "items"} else result  # type: ignore[call-overload]

        return call

    def _call(self, node: ast.Call, names: Mapping[str, Value]) -> Value:
        function = self._value(node.func, names)
        if not callable(function):
            raise Refused(f"'{ast.unparse(node)[:80]}' cannot be called")
        if any(keyword.arg is None for keyword in node.keywords):
            raise Refused("** is not allowed in an expression")
        positional = self._each(node.args, names)
        given = self._each([keyword.value for keyword in node.keywords], names)
        named = {str(keyword.arg): value for keyword, value in zip(node.keywords, given, strict=True)}
        if function is not instance_of:  # callbacks that are called repeatedly (map, the key of sorted) are watched
            positional = [self._watched(value) if callable(value) else value for value in positional]
            named = {name: self._watched(value) if callable(value) else value for name, value in named.items()}
        return self._watched(function)(*positional, **named)

    def _watched(self, function: Callable[..., Value]) -> Callable[..., Value]:
        """`function` with a check of the clock before each call and a bound on the total size of all results."""
        held = Held()
        called = self._set if function is set else self._mapping if function is dict else function

        def call(*values: Value, **named: Value) -> Value:
            self._clock.look()
            return held.add(called(*values, **named))

        return call

    def _set(self, *values: Value) -> Value:
        found: set[Value] = set()
        for part in self._parts(*values):
            found.update(part)
        return found

    def _mapping(self, *values: Value, **named: Value) -> Value:
        if any(isinstance(value, dict) for value in values):
            return dict(*values, **named)
        found: dict[Value, Value] = {}
        for part in self._parts(*values):
            found.update(cast("list[tuple[Value, Value]]", part))
        return found | named

    def _parts(self, values: Value = ()) -> Iterator[list[Value]]:
        """The items in blocks of 256: colliding hashes could make a large table take very long."""
        # A value without items raises a TypeError, which becomes a finding.
        items = list(values)  # type: ignore[call-overload]
        for start in range(0, len(items), 256):
            self._clock.look()
            yield items[start : start + 256]

    def _listcomp(self, node: ast.ListComp, names: Mapping[str, Value]) -> Value:
        held = Held()
        scopes = self._scopes(node.generators, _Scope(names, {}))
        return [held.add(self._value(node.elt, scope)) for scope in scopes]

    def _generatorexp(self, node: ast.GeneratorExp, names: Mapping[str, Value]) -> Value:
        return self._listcomp(ast.ListComp(elt=node.elt, generators=node.generators), names)

    def _dictcomp(self, node: ast.DictComp, names: Mapping[str, Value]) -> Value:
        scopes = self._scopes(node.generators, _Scope(names, {}))
        held = Held()
        return {held.add(self._value(node.key, scope)): held.add(self._value(node.value, scope)) for scope in scopes}

    def _setcomp(self, node: ast.SetComp, names: Mapping[str, Value]) -> Value:
        return self._set(self._listcomp(ast.ListComp(elt=node.elt, generators=node.generators), names))

    def _scopes(self, generators: list[ast.comprehension], scope: _Scope) -> Iterator[_Scope]:
        if not generators:
            yield scope
            return
        first, rest = generators[0], generators[1:]
        items = self._value(first.iter, scope)
        if not isinstance(items, str | list | tuple | dict):
            raise Refused(f"'{ast.unparse(first.iter)[:80]}' is not iterable")
        for item in items:
            inner = _Scope(scope, _targets(first.target, item))
            if all(self._value(test, inner) for test in first.ifs):
                yield from self._scopes(rest, inner)


class _Scope(Mapping[str, Value]):
    """The variables of a comprehension, which shadow the outer names."""

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
    raise Refused("only names and tuples of names are allowed as variables of a comprehension")


def _of_integers(kind: ast.operator, left: Value, right: Value) -> Value:
    if not isinstance(left, int) or not isinstance(right, int):
        raise Refused(f"operator {type(kind).__name__} is allowed only for integers")
    if isinstance(kind, ast.LShift) and right > MAX_SHIFT:
        raise Refused(f"a shift by more than {MAX_SHIFT} is not allowed")
    return _OF_INTEGERS[type(kind)](left, right)


def _formatted(text: str, values: Value) -> Value:
    """`text % values`, with widths of at most three digits.

    Raises:
        Refused: unsupported directive, or the result is too large.
    """
    directives = _DIRECTIVE.findall(text)
    if "%" in _DIRECTIVE.sub("", text):
        raise Refused(f"unsupported format '{text[:80]}'", hint="use %d, %s or %.3f, and %% for a percent sign")
    if len(directives) * size_of(values) > bounds().value_size * 4:
        raise too_large("a text")
    return text % values
