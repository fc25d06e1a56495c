"""Patterns match as Python's `re` does; those that it would search for years are answered at once."""

from __future__ import annotations

import random
import re

import pytest

from manipcli.live.name_pattern import BadPattern, matches


def pattern(rng: random.Random, depth: int = 0) -> str:
    """A random pattern that has the same meaning in POSIX and in Python."""
    pieces = []
    for _ in range(rng.randint(0, 3)):
        atom = rng.choice(["a", "b", ".", "\\+", "[ab]", "[^a]", "[a-b_]", "[]a]", "^", "$", "("])
        if atom == "(" and depth < 3:
            pieces.append(
                f"({'|'.join(pattern(rng, depth + 1) for _ in range(rng.randint(1, 3)))})" + rng.choice(["", "?"])
            )
        elif atom in "^$(":
            pieces.append("$" if atom == "$" else "^")
        else:
            pieces.append(atom + rng.choice(["", "", "*", "+", "?", "{2}", "{1,}", "{0,2}"]))
    return "".join(pieces)


def test_random_patterns_match_as_in_python() -> None:
    rng = random.Random(1)
    found = [False, False]
    for _ in range(4000):
        text = pattern(rng) or "a"
        if len(text) > 80:
            continue
        name = "".join(rng.choices("ab+_]", k=rng.randint(0, 5)))
        expected = re.fullmatch(text, name) is not None
        assert matches(text, name) is expected, (text, name)
        found[expected] = True
    assert all(found)


def test_classes_are_those_of_posix() -> None:
    assert matches("cup_[[:digit:]]+", "cup_12")
    assert not matches("cup_[^[:digit:]]", "cup_1")


@pytest.mark.parametrize("text", ["(|)" * 25 + "x", "(.|.)" * 16, "a*" * 39 + "b", "(" * 15 + "a" + ")" * 15 + "?"])
def test_patterns_with_countless_paths_end(text: str) -> None:
    assert not matches(text, "a" * 60 + "c")


INVALID = ["[", "[b-a]", "[[:x:]]", "\\1", "\\", "a**", "*", "a{x}", "(a", "a)", "(?=a)"]
UNSUPPORTED = ["(a+)+", "(a|b)*c", "(a){2,}", "a" * 81, "(" * 30 + ")" * 30]


@pytest.mark.parametrize("text", [*INVALID, *UNSUPPORTED])
def test_what_is_invalid_or_repeats_a_group_is_refused(text: str) -> None:
    with pytest.raises(BadPattern):
        matches(text, "ball")
