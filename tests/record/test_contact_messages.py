"""Messages of contacts: the bytes of rosbags, for every alignment, and what reads back, with points and without."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.model.state import Contact, ContactPoint
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.messages import ContactEncoder
from manipcli.record.read.contacts import have_points, read_contacts
from manipcli.record.schemas import CONTACTS, CONTACTS_WITHOUT_POINTS, schema_text


def _contacts(count: int) -> tuple[Contact, ...]:
    """Names of all lengths modulo 8, with 0 to 4 points."""
    rng = np.random.default_rng(count)
    found = []
    for k in range(count):
        rows = rng.normal(size=(k % 5, 10)).tolist()
        points = tuple(ContactPoint((a, b, c), (d, e, f), g, (h, i, j)) for a, b, c, d, e, f, g, h, i, j in rows)
        force, distance = rng.normal(size=2).tolist()
        found.append(Contact("a" * (1 + k % 8), "é" * (1 + k // 8 % 8), force, distance, points))
    return tuple(found)


def _by_rosbags(contacts: tuple[Contact, ...], ns: int, *, points: bool) -> bytes:
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema_text(CONTACTS) if points else CONTACTS_WITHOUT_POINTS, CONTACTS))
    kinds: dict[str, Any] = store.types

    def vector(kind: str, values: tuple[float, float, float]) -> Any:
        return kinds[f"geometry_msgs/msg/{kind}"](*values)

    def point(one: ContactPoint) -> Any:
        return kinds["manipcli_msgs/msg/ContactPoint"](
            vector("Point", one.position), vector("Vector3", one.normal), one.force, vector("Vector3", one.friction)
        )

    stamp = kinds["builtin_interfaces/msg/Time"](*divmod(ns, 1_000_000_000))
    header = kinds["std_msgs/msg/Header"](stamp, "world")
    listed = [
        kinds["manipcli_msgs/msg/Contact"](*one[:4], *([[point(p) for p in one.points]] if points else []))
        for one in contacts
    ]
    return bytes(store.serialize_cdr(kinds[CONTACTS](header, listed), CONTACTS))


@pytest.mark.parametrize("count", [0, 1, 2, 70])
def test_the_bytes_are_those_of_rosbags(count: int) -> None:
    encoder, contacts, ns = ContactEncoder(), _contacts(count), 12_345_678_901
    for order in (contacts, contacts[::-1], contacts):  # other alignments, then from the cache
        data = encoder.encode(ns, order)
        assert data == _by_rosbags(order, ns, points=True)
        assert read_contacts(CdrReader(data), points=True) == order
        without = tuple(contact._replace(points=()) for contact in order)
        assert read_contacts(CdrReader(data), points=True, skip=True) == without


def test_messages_without_points_are_read() -> None:
    contacts = _contacts(20)
    found = read_contacts(CdrReader(_by_rosbags(contacts, 5, points=False)), points=False)
    assert found == tuple(contact._replace(points=()) for contact in contacts)


def test_the_schema_decides() -> None:
    assert have_points(schema_text(CONTACTS))
    assert not have_points(CONTACTS_WITHOUT_POINTS)
    assert have_points("\n".join(line for line in schema_text(CONTACTS).splitlines() if not line.startswith("#")))
    longer = schema_text(CONTACTS).replace("float64 distance\n", "float64 distance\nfloat64 area\n")
    with pytest.raises(ValueError, match="have fields that this manipcli does not know"):
        have_points(longer)
    with pytest.raises(ValueError, match="cannot be read: type 'x/Y' is used but not defined"):
        have_points("x/Y z\n")


def test_a_message_that_ends_early_is_refused() -> None:
    data = ContactEncoder().encode(0, _contacts(4))
    read_contacts(CdrReader(data), points=True)
    for end in itertools.chain(range(4, len(data) - 1, 7), [len(data) - 1]):
        with pytest.raises(CdrError):
            read_contacts(CdrReader(data[:end]), points=True)
