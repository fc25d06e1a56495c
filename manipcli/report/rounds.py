"""What several rounds of a loop have in common, told once."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from typing import Final, TypeVar

from manipcli.core.errors import Diagnostic
from manipcli.core.text import number_of

_NAME: Final = re.compile(r"'[^']*'")
_NUMBER: Final = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_ROUND: Final = re.compile(r"\[\d+\]")
_OF_A_ROUND: Final = re.compile(r"step '([^']*\[\d+\][^']*)': ")
T = TypeVar("T")


def first_of_rounds(items: Iterable[T], key: Callable[[T], object]) -> list[tuple[T, str]]:
    """The first of the items of each `key`, and `; and 11 more rounds` for the others; a key of None is alone."""
    groups: dict[object, list[T]] = {}
    for k, item in enumerate(items):
        own = key(item)
        groups.setdefault(("alone", k) if own is None else own, []).append(item)
    return [(of[0], f"; and {number_of(len(of) - 1, 'more round')}" if len(of) > 1 else "") for of in groups.values()]


def round_of(step: str, text: str) -> tuple[str, str] | None:
    """What the same text about other rounds of a step has in common, up to names and numbers; None outside a loop."""
    if not _ROUND.search(step):
        return None
    return _ROUND.sub("[]", step), _NUMBER.sub("#", _NAME.sub("''", text))


def round_of_finding(finding: Diagnostic) -> object:
    """As `round_of`, of a finding that begins with its step; one that is no note has the same numbers, too."""
    found = _OF_A_ROUND.match(finding.message)
    if found is None:
        return None
    step, text = found[1], finding.message[found.end() :]
    same = "" if finding.severity == "note" else _NAME.sub("''", text)
    return finding.code, str(finding.place), finding.hint, round_of(step, text), same
