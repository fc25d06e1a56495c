"""YAML with a comment above each value."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from manipcli.spec.resolved import inline
from manipcli.spec.source.tree import Plain

WIDTH: Final = 118
CHECK: Final = "CHECK: "
"""Begins the comment of a value that is only plausible."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A value with the evidence for it; `check`: it is only plausible, and the user should look at it."""

    value: Plain | Mapping[str, Entry]
    why: str = ""
    check: bool = False


def written(entries: Mapping[str, Entry], *, head: Iterable[str] = ()) -> str:
    """The text of a file: comment lines `head`, then the entries; nested mappings of entries are blocks."""
    lines = [f"# {line}" for line in head]
    lines += _lines(entries, "")
    return "\n".join(lines) + "\n"


def checks(entries: Mapping[str, Entry], path: str = "") -> list[tuple[str, str]]:
    """(path, evidence) of the entries that the user should look at."""
    found = []
    for key, entry in entries.items():
        where = f"{path}.{key}" if path else key
        if entry.check:
            found.append((where, entry.why))
        if isinstance(entry.value, Mapping) and _nested(entry.value):
            found += checks(entry.value, where)  # type: ignore[arg-type]
    return found


def _nested(value: object) -> bool:
    return isinstance(value, Mapping) and any(isinstance(each, Entry) for each in value.values())


def _lines(entries: Mapping[str, Entry], indent: str) -> list[str]:
    lines: list[str] = []
    for key, entry in entries.items():
        if entry.why:
            text = f"{CHECK if entry.check else ''}{entry.why}"
            lines += [f"{indent}# {line}" for line in textwrap.wrap(text, WIDTH - len(indent) - 2)]
        value = entry.value
        if _nested(value):
            lines.append(f"{indent}{inline(key)}:")
            lines += _lines(value, f"{indent}  ")  # type: ignore[arg-type]
        elif isinstance(value, list) and any(isinstance(each, dict) for each in value):
            lines.append(f"{indent}{inline(key)}:")
            lines += [f"{indent}  - {inline(each)}" for each in value]
        else:
            lines.append(f"{indent}{inline(key)}: {inline(value)}")  # type: ignore[arg-type]
    return lines
