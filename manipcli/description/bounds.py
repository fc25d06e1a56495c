"""How large and how deep a description may be, and how a user raises that."""

from __future__ import annotations

import dataclasses
import functools
import os
from dataclasses import dataclass
from typing import Final, Literal

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import did_you_mean, shorten

VARIABLE: Final = "MANIPCLI_BOUNDS"
"""Holds bounds of the user's own, `seconds=60 elements=200000`; every command that reads descriptions heeds it."""

BoundName = Literal[
    "file_bytes",
    "elements",
    "depth",
    "attribute",
    "expansions",
    "macro_depth",
    "include_depth",
    "operations",
    "value_size",
    "yaml_bytes",
    "characters",
    "seconds",
]


@dataclass(frozen=True, slots=True)
class Bounds:
    """Generous for any robot: the largest of 57 descriptions has 700 kB, 2,900 elements and 1,900 expansions.

    Attributes:
        file_bytes: of a file of XML.
        elements: in one file, and in the expanded description.
        depth: of elements in elements.
        attribute: characters of one attribute.
        expansions: elements and macros that xacro expands.
        macro_depth: of macros that call macros.
        include_depth: of files that include files.
        operations: of all expressions of a description.
        value_size: characters and items of what one expression gives.
        yaml_bytes: of a file that `load_yaml` reads.
        characters: of all text and attributes that an expansion makes; an element or item of data counts, too.
        seconds: of processor time for one expansion.
    """

    file_bytes: int = 20_000_000
    elements: int = 50_000
    depth: int = 100
    attribute: int = 65_536
    expansions: int = 50_000
    macro_depth: int = 64
    include_depth: int = 32
    operations: int = 1_000_000
    value_size: int = 65_536
    yaml_bytes: int = 1_000_000
    characters: int = 20_000_000
    seconds: int = 20


def bounds() -> Bounds:
    """The bounds that hold, with the user's own from the environment.

    Raises:
        InvalidInput: the variable does not say `NAME=NUMBER NAME=NUMBER ...`.
    """
    return _parsed(os.environ.get(VARIABLE, ""))


@functools.lru_cache(maxsize=8)
def _parsed(text: str) -> Bounds:
    own: dict[str, int] = {}
    known = [field.name for field in dataclasses.fields(Bounds)]
    for word in text.replace(",", " ").split():
        name, _, number = word.partition("=")
        if name not in known or not number.isascii() or not number.isdigit() or not 0 < int(number[:12]) < 10**10:
            message = f"{VARIABLE}: '{shorten(word)}' is no bound; expected NAME=NUMBER"
            hint = "whole numbers above 0" if name in known else did_you_mean(name, known, kind="bounds")
            raise InvalidInput([Diagnostic("USE040", message, hint=hint)])
        own[name] = int(number)
    return dataclasses.replace(Bounds(), **own)


def raised(name: BoundName) -> str:
    """The hint that says which bound was met and how to raise it."""
    value = getattr(bounds(), name)
    return f"the bound is {name}={value}; for a description that you trust, raise it: {VARIABLE}={name}={2 * value}"
