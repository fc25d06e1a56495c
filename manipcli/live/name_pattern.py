"""Regular expressions of clients, of a form whose search time is bounded: names are matched in the control loop."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

LONGEST: Final = 200
"""Longest pattern [characters]."""
REPETITIONS: Final = 3
"""Most repetitions in a pattern, none of them of a group: the search time is bounded by the name's length."""
_REPEATED = re.compile(r"\\.|\[\^?\]?[^\]]*\]|(?P<group>\)[*+{])|(?P<once>[*+?{])|(?P<extended>\(\?)|.", re.DOTALL)


class BadPattern(ValueError):
    """A pattern that is invalid or not supported."""


def name_pattern(pattern: str) -> Callable[[str], bool]:
    """A function: whether a whole name matches a POSIX extended regular expression; "" matches all names.

    Raises:
        BadPattern: an invalid pattern, or one whose search could take long.
    """
    if not pattern:
        return lambda name: True
    kinds = [found.lastgroup for found in _REPEATED.finditer(pattern)]
    if len(pattern) > LONGEST or "group" in kinds or "extended" in kinds or kinds.count("once") > REPETITIONS:
        raise BadPattern(
            f"the filter '{pattern[:80]}' is not supported: at most {LONGEST} characters and {REPETITIONS} "
            "repetitions, and none of a group"
        )
    if re.search(r"\\[\w]", pattern):
        raise BadPattern(f"the filter '{pattern[:80]}' has a backslash before a letter or digit")
    try:
        compiled = re.compile(pattern)
    except (re.error, OverflowError, RecursionError) as error:
        raise BadPattern(f"the filter '{pattern[:80]}' is not a regular expression: {error}") from None
    return lambda name: compiled.fullmatch(name) is not None
