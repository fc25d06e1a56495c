"""`-k EXPRESSION`: which cases are meant, in words with `and`, `or`, `not` and brackets, as pytest has it."""

from __future__ import annotations

import re
from collections.abc import Callable

from manipcli.core.errors import Finding, InvalidInput
from manipcli.report.suite import Case

Choice = Callable[[Case], bool]
_TOKEN = re.compile(r"\s*(?:([()])|([^\s()]+))")


def chosen_by(expression: str) -> Choice:
    """What the expression says of a case: a word is true of a case whose id or one of whose tags it is a part of,
    whatever its case.

    Grammar, `or` binding weakest: `or: and ("or" and)*`, `and: not ("and" not)*`, `not: "not" not | "(" or ")" | WORD`.

    Raises:
        InvalidInput: it is none.
    """
    return _Parser(expression).whole()


class _Parser:
    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = [(one.group(1) or one.group(2), one.start() + 1) for one in _TOKEN.finditer(text)]
        self._next = 0

    def whole(self) -> Choice:
        choice = self._or()
        if self._next < len(self._tokens):
            raise self._refused("`and`, `or` or the end")
        return choice

    def _or(self) -> Choice:
        choice = self._and()
        while self._taken("or"):
            choice = _either(choice, self._and())
        return choice

    def _and(self) -> Choice:
        choice = self._not()
        while self._taken("and"):
            choice = _both(choice, self._not())
        return choice

    def _not(self) -> Choice:
        if self._taken("not"):
            choice = self._not()
            return lambda case: not choice(case)
        if self._taken("("):
            choice = self._or()
            if not self._taken(")"):
                raise self._refused("`)`")
            return choice
        word = self._peek()
        if word in (None, ")", "and", "or"):
            raise self._refused("a word, `not` or `(`")
        self._next += 1
        return _contains(str(word).lower())

    def _peek(self) -> str | None:
        return self._tokens[self._next][0] if self._next < len(self._tokens) else None

    def _taken(self, token: str) -> bool:
        if self._peek() != token:
            return False
        self._next += 1
        return True

    def _refused(self, expected: str) -> InvalidInput:
        found = self._peek()
        what = f"'{found}'" if found is not None else "the end"
        message = f"-k '{self._text}': {expected} was expected, not {what}"
        return InvalidInput([Finding("USE085", message, hint="for example: -k 'pour and not (slow or kinematic)'")])


def _either(one: Choice, other: Choice) -> Choice:
    return lambda case: one(case) or other(case)


def _both(one: Choice, other: Choice) -> Choice:
    return lambda case: one(case) and other(case)


def _contains(word: str) -> Choice:
    return lambda case: any(word in name.lower() for name in (case.id, *case.tags))
