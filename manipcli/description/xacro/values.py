"""Values and functions of xacro expressions, bounded in size and cost."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Final

from manipcli.description.bounds import BoundName, bounds, raised

MAX_INTEGER: Final = 2**1024
OPTENV: Final = "XACRO011"
"""Code of the note on a `$(optenv NAME DEFAULT)` whose default is used."""

Value = object


class Refused(Exception):
    """An expression uses something that is not allowed; `hint`: the alternative."""

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        self.hint = hint
        super().__init__(message)


class Beyond(Refused):
    """A bound is exceeded; `hint`: the bound and how to raise it."""

    def __init__(self, message: str, bound: BoundName) -> None:
        super().__init__(message, hint=raised(bound))


class Clock:
    """The processor time of one expansion, checked in every loop."""

    def __init__(self) -> None:
        self._seconds = bounds().seconds
        self._until = time.process_time() + self._seconds

    def look(self) -> None:
        """Raises Beyond when the time is used up."""
        if time.process_time() > self._until:
            raise Beyond(f"the expansion takes more than {self._seconds} s", "seconds")


class Held:
    """The total size of several values that exist at the same time."""

    def __init__(self) -> None:
        self._held = 0

    def add(self, value: Value) -> Value:
        """`value`; raises Beyond if the total exceeds the bound for one value."""
        self._held += size_of(value)
        if self._held > bounds().value_size:
            raise too_large("a value")
        return value


def size_of(value: Value) -> int:
    """Characters and items in a nested `value`, counted up to the bound + 1."""
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
    """`value`, if its size is allowed.

    Raises:
        Refused: it is too large.
    """
    if isinstance(value, bool | float) or value is None:
        return value
    if isinstance(value, int):
        if not -MAX_INTEGER < value < MAX_INTEGER:
            raise Refused("the integer is too large; expected less than 2**1024")
    elif size_of(value) > bounds().value_size:
        raise too_large("a value")
    return value


def too_large(what: str) -> Beyond:
    return Beyond(f"{what} has more than {bounds().value_size} characters or items", "value_size")


def math_symbols() -> dict[str, Value]:
    """The constants and functions of `math` whose cost does not grow with their argument."""
    costly = {"factorial", "comb", "perm", "prod", "lcm", "gcd", "isqrt", "dist", "fsum", "sumprod"}
    return {name: value for name, value in vars(math).items() if not name.startswith("_") and name not in costly}


_TYPES: Final[dict[str, type]] = {kind.__name__: kind for kind in (bool, dict, float, int, list, set, str, tuple)}


def instance_of(value: Value, kinds: Value) -> bool:
    """`isinstance`, with the types of expressions, of which `list` and `str` are functions with a bound."""
    types = [_TYPES.get(getattr(kind, "__name__", "")) for kind in (kinds if isinstance(kinds, tuple) else (kinds,))]
    if None in types:
        raise TypeError(f"isinstance: expected one or several of {', '.join(_TYPES)}")
    return isinstance(value, tuple(kind for kind in types if kind is not None))


def python_symbols() -> dict[str, Value]:
    """The built-in functions that expressions may call."""

    def bounded_range(*ends: int) -> list[int]:
        steps = range(*ends)
        if len(steps) > bounds().value_size:
            raise too_large("a range")
        return list(steps)

    def in_order(values: Iterable[Value], *, key: Callable[..., Value] | None = None, reverse: bool = False) -> Value:
        # Values that cannot be compared raise a TypeError, which becomes a finding.
        return bounded(sorted(values, key=key, reverse=reverse))  # type: ignore[type-var,arg-type]

    def total(values: Iterable[Value], start: Value = 0) -> Value:
        items = list(values)
        if size_of(start) * len(items) > bounds().value_size * 64:
            raise too_large("a sum of lists")
        # Values that cannot be added raise a TypeError, too.
        return sum(items, start)  # type: ignore[call-overload]

    def text(value: Value = "") -> str:
        return str(bounded(value))

    def apply(function: Callable[..., Value], *values: Iterator[Value]) -> Value:
        held = Held()
        return [held.add(function(*items)) for items in zip(*values, strict=False)]

    def listed(function: Callable[..., Value]) -> Callable[..., Value]:
        # A Value may be a number, for which zip and others raise a TypeError, which becomes a finding.
        def call(*values: Value) -> Value:
            return bounded(list(function(*(bounded(value) for value in values))))  # type: ignore[call-overload]

        return call

    kept = (float, int, bool, len, min, max, round, abs, all, any, divmod, ord, dict, tuple, set)
    symbols: dict[str, Value] = {function.__name__: function for function in kept}
    own: dict[str, Callable[..., Value]] = {function.__name__: listed(function) for function in _LISTED}
    own |= {"range": bounded_range, "str": text, "map": apply, "sorted": in_order, "sum": total}
    own["isinstance"] = instance_of
    for name, function in own.items():
        function.__name__ = function.__qualname__ = name  # shown in Python's messages
    return symbols | own | {"True": True, "False": False, "None": None}


_LISTED: Final[tuple[Callable[..., Value], ...]] = (list, zip, enumerate, reversed)
