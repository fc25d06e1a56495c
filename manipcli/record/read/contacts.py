"""Messages of contacts, with contact points or, in logs of format 1, without them."""

from __future__ import annotations

import struct

from manipcli.model.state import Contact, ContactPoint
from manipcli.record.cdr import CdrReader
from manipcli.record.definition import UnknownDefinition, read_definition
from manipcli.record.schemas import CONTACTS, CONTACTS_WITHOUT_POINTS, schema_text

_POINT = struct.Struct("<10d")
_SMALLEST = 16
"""Least size of a contact [byte]."""


def have_points(definition: str) -> bool:
    """Whether the messages of a schema have contact points.

    Args:
        definition: text of the schema.

    Raises:
        ValueError: the messages have another layout; see its message.
    """
    try:
        found = read_definition(CONTACTS, definition)
    except UnknownDefinition as error:
        raise ValueError(f"its schema of {CONTACTS} cannot be read: {error}") from error
    if found == read_definition(CONTACTS, schema_text(CONTACTS)):
        return True
    if found == read_definition(CONTACTS, CONTACTS_WITHOUT_POINTS):
        return False
    raise ValueError(f"its {CONTACTS} have fields that this manipcli does not know")


def read_contacts(reader: CdrReader, *, points: bool, skip: bool = False) -> tuple[Contact, ...]:
    """All contacts of a message; `points`: they have contact points; `skip`: leave these out."""
    read = _skipped if skip else _points
    reader.header()
    return tuple(
        Contact(
            a=reader.text(),
            b=reader.text(),
            force=reader.f64(),
            distance=reader.f64(),
            points=read(reader) if points else (),
        )
        for _ in range(reader.count(_SMALLEST))
    )


def _points(reader: CdrReader) -> tuple[ContactPoint, ...]:
    count = reader.count(_POINT.size)
    if not count:
        return ()  # no alignment of a first number
    return tuple(
        ContactPoint((x, y, z), (nx, ny, nz), force, (fx, fy, fz))
        for x, y, z, nx, ny, nz, force, fx, fy, fz in _POINT.iter_unpack(reader.take(count * _POINT.size, 8))
    )


def _skipped(reader: CdrReader) -> tuple[ContactPoint, ...]:
    count = reader.count(_POINT.size)
    if count:
        reader.skip(count * _POINT.size, 8)
    return ()
