"""Texts of xacro as words and values."""

from __future__ import annotations


def typed(text: str) -> object:
    """An argument as `$(eval)` sees it: a number or boolean if it is one, else text."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return {"true": True, "false": False}.get(text.lower(), text)


def tokenize(text: str, sep: str = ",; ", skip_empty: bool = True) -> list[str]:
    for character in sep:
        text = text.replace(character, "\0")
    return [token for token in text.split("\0") if token or not skip_empty]
