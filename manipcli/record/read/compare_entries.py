"""What two logs hold beside messages: metadata and attachments, key by key and line by line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from manipcli.record.recording import Recording


@dataclass(frozen=True, slots=True)
class EntryDifference:
    """A metadata record or an attachment that is not the same in two logs.

    Attributes:
        kind: `metadata` or `attachment`.
        name: of it.
        where: the first key or line that differs; "" where the whole is not there, or is no text.
        a, b: what each log has; None: nothing.
        count: how many keys or lines differ; 0 where they were not counted.
    """

    kind: str
    name: str
    where: str
    a: str | None
    b: str | None
    count: int


def compare_entries(a: Recording, b: Recording) -> tuple[EntryDifference, ...]:
    """Every record of metadata and every attachment that differs, in the order of the first log."""
    found = [
        _metadata(name, a.metadata.get(name, {}), b.metadata.get(name, {}))
        for name in dict.fromkeys((*a.metadata, *b.metadata))
    ]
    names = dict.fromkeys((*a.attachments, *b.attachments))
    found += [_attachment(name, a.attachments.get(name), b.attachments.get(name)) for name in names]
    return tuple(one for one in found if one is not None)


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
        return EntryDifference("attachment", name, "", "other line ends", "other line ends", 0)
    k, x, y = unlike[0]
    return EntryDifference("attachment", name, f"line {k}", x and x.strip(), y and y.strip(), len(unlike))
