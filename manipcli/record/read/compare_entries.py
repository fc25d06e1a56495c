"""Comparison of metadata and attachments of two logs, by key and by line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from manipcli.record.recording import Recording


@dataclass(frozen=True, slots=True)
class EntryDifference:
    """A metadata record or an attachment that differs in two logs.

    Attributes:
        kind: `metadata` or `attachment`.
        name: its name.
        where: the first key or line that differs; "" if it is missing or not a text.
        a, b: value in each log; None if missing.
        count: number of keys or lines that differ; 0 if not counted.
    """

    kind: str
    name: str
    where: str
    a: str | None
    b: str | None
    count: int


def compare_entries(a: Recording, b: Recording) -> tuple[EntryDifference, ...]:
    """All metadata records and attachments that differ, in the order of the first log."""
    found = [
        _metadata(name, a.metadata.get(name, {}), b.metadata.get(name, {}))
        for name in dict.fromkeys((*a.metadata, *b.metadata))
    ]
    names = dict.fromkeys((*a.attachments, *b.attachments))
    found += [_attachment(name, a.attachments.get(name), b.attachments.get(name)) for name in names]
    return tuple(difference for difference in found if difference is not None)


def _metadata(name: str, a: Mapping[str, str], b: Mapping[str, str]) -> EntryDifference | None:
    unlike = [key for key in dict.fromkeys((*a, *b)) if a.get(key) != b.get(key)]
    if not unlike:
        return None
    return EntryDifference("metadata", name, unlike[0], a.get(unlike[0]), b.get(unlike[0]), len(unlike))


def _attachment(name: str, a: bytes | None, b: bytes | None) -> EntryDifference | None:
    if a == b:
        return None
    if a is None or b is None:
        left_size, right_size = (None if x is None else f"{len(x)} bytes" for x in (a, b))
        return EntryDifference("attachment", name, "", left_size, right_size, 0)
    try:
        left, right = (x.decode().splitlines() for x in (a, b))
    except UnicodeDecodeError:
        return EntryDifference("attachment", name, "", f"{len(a)} bytes", f"{len(b)} bytes, or others", 0)
    longest = max(len(left), len(right))
    pairs = zip([*left, *[None] * (longest - len(left))], [*right, *[None] * (longest - len(right))], strict=True)
    unlike = [(k, x, y) for k, (x, y) in enumerate(pairs, start=1) if x != y]
    if not unlike:
        return EntryDifference("attachment", name, "", "different line endings", "different line endings", 0)
    k, x, y = unlike[0]
    return EntryDifference("attachment", name, f"line {k}", x and x.strip(), y and y.strip(), len(unlike))
