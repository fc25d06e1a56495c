"""Suggestions of similar names for errors in a xacro file."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final

from manipcli.core.text import any_of, nearest

_TAGS: Final = ("arg", "attribute", "call", "element", "if", "include", "insert_block", "macro", "property", "unless")


class UnknownArgument(NameError):
    """`$(arg NAME)` of an argument without a value and a default."""

    def __init__(self, name: str, known: Collection[str]) -> None:
        close = nearest(name, known)
        self.hint = (
            f"did you mean {any_of(close)}?"
            if close
            else f"pass it: `args: {{{name}: VALUE}}` in a robot file, {name}:=VALUE on the command line"
        )
        super().__init__(f"argument '{name}' has neither a value nor a default")


def names_of(symbols: object) -> list[str]:
    """The names in a symbol table of the xacro library and in its parents."""
    found: list[str] = []
    while isinstance(symbols, Mapping) and len(found) < 2000:
        found += [str(name) for name in dict.keys(symbols)] if isinstance(symbols, dict) else list(symbols)
        symbols = getattr(symbols, "parent", None)
    return found


def near_name(error: NameError, known: Collection[str]) -> str | None:
    quoted = str(error).split("'")
    close = nearest(quoted[1], known) if len(quoted) > 2 else ()
    return f"did you mean {any_of(close)}?" if close else None


def near_macro(tag: str, known: Collection[str]) -> str | None:
    close = nearest(tag.removeprefix("xacro:"), [*(name.removeprefix("xacro:") for name in known), *_TAGS])
    return f"did you mean <xacro:{close[0]}>?" if close else None
