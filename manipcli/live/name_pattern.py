"""POSIX extended regular expressions of clients, with a search time that is bounded.

Names are matched in the control loop, also for clients without a token; Python's `re` can take years for 80 characters.
The pattern is read once, with the set of places in the name that are reached; so a group cannot be repeated.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

LONGEST: Final = 80
"""Longest pattern [characters]."""
DEEPEST: Final = 20
"""Deepest nesting of groups."""
_TIMES = re.compile(r"\{([0-9]{1,4})(,([0-9]{1,4})?)?\}")
_CLASSES: Final[dict[str, Callable[[str], bool]]] = {
    "alpha": str.isalpha, "digit": str.isdigit, "alnum": str.isalnum, "upper": str.isupper, "lower": str.islower,
    "space": str.isspace,
}  # fmt: skip


class BadPattern(ValueError):
    """A pattern that is invalid or not supported."""


def matches(pattern: str, name: str) -> bool:
    """Whether a whole name matches; "" matches all names.

    Raises:
        BadPattern: an invalid pattern, a repeated group, or a limit is exceeded.
    """
    if len(pattern) > LONGEST:
        raise BadPattern(f"the filter has {len(pattern)} characters; at most {LONGEST} are supported")
    return not pattern or len(name) in _Search(pattern, name).ends()


class _Search:
    """One pass through a pattern; sets are the places in the name that what was read so far can reach."""

    def __init__(self, pattern: str, name: str) -> None:
        self._pattern, self._name = pattern, name
        self._at = self._depth = 0

    def ends(self) -> set[int]:
        found = self._alternatives({0})
        if self._at < len(self._pattern):
            raise self._bad("a ')' without a '('")
        return found

    def _bad(self, why: str) -> BadPattern:
        return BadPattern(f"the filter '{self._pattern[:80]}' has {why}")

    def _next(self) -> str:
        return self._pattern[self._at : self._at + 1]

    def _take(self) -> str:
        self._at += 1
        return self._pattern[self._at - 1]

    def _alternatives(self, here: set[int]) -> set[int]:
        found: set[int] = set()
        while True:
            reached = here
            while self._next() not in ("", "|", ")"):
                reached = self._piece(reached)
            found |= reached
            if self._next() != "|":
                return found
            self._at += 1

    def _piece(self, here: set[int]) -> set[int]:
        letter = self._take()
        if letter == "(":
            return self._group(here)
        if letter in "^$":
            return here & {0 if letter == "^" else len(self._name)}
        fits = self._atom(letter)
        least, most = self._times()
        once = [fits(each) for each in self._name]
        for _ in range(least):
            here = {place + 1 for place in here if place < len(once) and once[place]}
            if not here:
                break
        if most >= len(once):  # from each place as far as it fits
            here = set(here)
            for place, fit in enumerate(once):
                if fit and place in here:
                    here.add(place + 1)
            return here
        found = set(here)
        for _ in range(most - least):
            here = {place + 1 for place in here if place < len(once) and once[place]} - found
            found |= here
        return found

    def _group(self, here: set[int]) -> set[int]:
        self._depth += 1
        if self._depth > DEEPEST:
            raise self._bad(f"groups nested deeper than {DEEPEST}")
        inside = self._alternatives(here)
        if self._next() != ")":
            raise self._bad("a '(' without a ')'")
        self._at += 1
        self._depth -= 1
        least, most = self._times()
        if (least, most) not in ((1, 1), (0, 1)):
            raise self._bad("a repeated group, which is not supported")
        return inside if least else here | inside

    def _atom(self, letter: str) -> Callable[[str], bool]:
        if letter == ".":
            return lambda each: True
        if letter == "[":
            return self._bracket()
        if letter == "\\":
            if not self._next() or self._next().isalnum():
                raise self._bad("a '\\' without a sign after it")
            letter = self._take()
        elif letter in "*+?{":
            raise self._bad(f"a '{letter}' with nothing to repeat")
        return letter.__eq__

    def _times(self) -> tuple[int, int]:
        """The least and the most repetitions of what was read."""
        letter, endless = self._next(), len(self._name)
        if letter not in ("*", "+", "?", "{"):
            return 1, 1
        found = _TIMES.match(self._pattern, self._at)
        if letter == "{" and found is None:
            raise self._bad("an invalid '{'")
        self._at = self._at + 1 if found is None else found.end()
        if self._next() in ("*", "+", "?", "{"):
            raise self._bad("two repetitions in a row")
        if found is None:
            return {"*": (0, endless), "+": (1, endless), "?": (0, 1)}[letter]
        least = int(found[1])
        return least, int(found[3]) if found[3] else endless if found[2] else least

    def _bracket(self) -> Callable[[str], bool]:
        found = re.compile(r"(\^?)(\]?(?:\[:[a-z]+:\]|[^\]])*)\]").match(self._pattern, self._at)
        if found is None:
            raise self._bad("a '[' without a ']'")
        self._at = found.end()
        ranges: list[tuple[str, str]] = []
        classes: list[Callable[[str], bool]] = []
        for word, low, high in re.findall(r"\[:([a-z]+):\]|(.)(?:-(.))?", found[2], re.DOTALL):
            if word in _CLASSES:
                classes.append(_CLASSES[word])
            elif word or (high and high < low):
                raise self._bad(f"an unknown class or range in '[{found[2][:40]}]'")
            else:
                ranges.append((low, high or low))

        def fits(each: str) -> bool:
            inside = any(low <= each <= high for low, high in ranges) or any(known(each) for known in classes)
            return inside is not bool(found[1])

        return fits
