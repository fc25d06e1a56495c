"""YAML with a comment above each value."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

from manipcli.spec.resolved import inline
from manipcli.spec.source.tree import Plain

WIDTH: Final = 118
CHECK: Final = "CHECK: "
"""Begins the comment of a value that is only plausible."""


Value: TypeAlias = "str | int | float | bool | Sequence[Value] | Mapping[str, Value | Entry] | None"


@dataclass(frozen=True, slots=True)
class Entry:
    """A value with the evidence for it; `check`: it is only plausible, and the user should look at it."""

    value: Value
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
        found += checks(block(entry), where)
    return found


def block(entry: Entry) -> dict[str, Entry]:
    """The entries inside an entry; {} if it is a plain value."""
    value = entry.value
    if not isinstance(value, Mapping):
        return {}
    return {key: each for key, each in value.items() if isinstance(each, Entry)}


def plain(value: Value | Entry) -> Plain:
    """The value without its comments."""
    if isinstance(value, Entry):
        return plain(value.value)
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(each) for each in value]
    return value


def _lines(entries: Mapping[str, Entry], indent: str) -> list[str]:
    lines: list[str] = []
    for key, entry in entries.items():
        if entry.why:
            text = f"{CHECK if entry.check else ''}{entry.why}"
            lines += [f"{indent}# {line}" for line in textwrap.wrap(text, WIDTH - len(indent) - 2)]
        inside, value = block(entry), plain(entry)
        if inside:
            lines += [f"{indent}{inline(key)}:", *_lines(inside, f"{indent}  ")]
        elif isinstance(value, list) and any(isinstance(each, dict | list) for each in value):
            lines.append(f"{indent}{inline(key)}:")
            lines += [f"{indent}  - {inline(each)}" for each in value]
        else:
            lines.append(f"{indent}{inline(key)}: {inline(value)}")
    return lines
