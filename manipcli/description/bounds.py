"""Bounds on the size, depth and cost of a description, and the environment variable that raises them."""

from __future__ import annotations

import dataclasses
import functools
import os
from dataclasses import dataclass
from typing import Final, Literal

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import did_you_mean, shorten

VARIABLE: Final = "MANIPCLI_BOUNDS"
"""Environment variable that overrides bounds, `seconds=60 elements=200000`, in all commands."""

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
    """The largest of 57 public descriptions has 700 kB, 2,900 elements and 1,900 expansions.

    Attributes:
        file_bytes: of an XML file.
        elements: in one file, and in the expanded description.
        depth: of nested elements.
        attribute: characters of one attribute.
        expansions: elements and macros that xacro expands.
        macro_depth: of nested macro calls.
        include_depth: of nested includes.
        operations: of all expressions in a description.
        value_size: characters and items in the value of one expression.
        yaml_bytes: of a file that `load_yaml` reads.
        characters: of all text and attributes that an expansion creates; elements and data items count, too.
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
    """The bounds, with overrides from the environment.

    Raises:
        InvalidInput: the variable is not of the form `NAME=NUMBER NAME=NUMBER ...`.
    """
    return _parsed(os.environ.get(VARIABLE, ""))


@functools.lru_cache(maxsize=8)
def _parsed(text: str) -> Bounds:
    own: dict[str, int] = {}
    known = [field.name for field in dataclasses.fields(Bounds)]
    for word in text.replace(",", " ").split():
        name, _, number = word.partition("=")
        if name not in known or not number.isascii() or not number.isdigit() or not 0 < int(number[:12]) < 10**10:
            message = f"{VARIABLE}: invalid bound '{shorten(word)}'; expected NAME=NUMBER"
            hint = "use a whole number above 0" if name in known else did_you_mean(name, known, kind="bounds")
            raise InvalidInput([Diagnostic("USE040", message, hint=hint)])
        own[name] = int(number)
    return dataclasses.replace(Bounds(), **own)


def raised(name: BoundName) -> str:
    """The hint with the bound that was exceeded and how to raise it."""
    value = getattr(bounds(), name)
    return f"the bound is {name}={value}; if you trust the description, raise it: {VARIABLE}={name}={2 * value}"
