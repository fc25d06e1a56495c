"""Contacts of a MuJoCo world: one per touching pair of parts, with its points."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import Any, Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.state import Contact, ContactPoint

KNOCK: Final = 1.5
"""A contact point with more than this factor of the largest force, plus `KNOCK_LEAST`, is an impact."""
KNOCK_LEAST: Final = 1.0
"""[N]"""
FORCES: Final = np.arange(3)
"""Rows of a contact: normal force, and friction along two directions."""
_sides = attrgetter("a", "b")


class Contacts:
    """Contacts of one world, as the last physics step computed them.

    Args:
        data: `MjData`.
        model: `MjModel`.
        parts: name of the part of each MuJoCo body.
    """

    def __init__(self, model: Any, data: Any, parts: Sequence[str]) -> None:
        self._data = data
        names = [parts[body] for body in model.geom_bodyid]
        order = {name: k for k, name in enumerate(sorted(set(names)))}
        self._names = sorted(order)
        self._part = np.array([order[name] for name in names], dtype=np.int64)
        self._robot = np.array([name.startswith("robot/") for name in names], dtype=np.bool_)
        self._geoms, self._pairs = b"", frozenset[int]()
        self._knock = KNOCK_LEAST

    def changed(self) -> bool:
        """Whether parts touch or part since `now`, or the force at a contact point of the robot grew a lot."""
        data = self._data
        if not data.ncon:
            return bool(self._pairs)
        contact = data.contact
        geoms = contact.geom
        if geoms.tobytes() != self._geoms and self._touching(geoms) != self._pairs:
            return True
        forces = data.efc_force[contact.efc_address]
        return bool(forces.max() > self._knock) and self._greatest(geoms, forces) > self._knock

    def now(self) -> tuple[Contact, ...]:
        """All contacts, sorted by the names of the parts; `changed` compares with them."""
        data = self._data
        if not data.ncon:
            self._geoms, self._pairs, self._knock = b"", frozenset(), KNOCK_LEAST
            return ()
        contact = data.contact
        geoms, address = contact.geom, contact.efc_address
        self._geoms, self._pairs = geoms.tobytes(), self._touching(geoms)
        forces = data.efc_force[address[:, None] + FORCES]
        self._knock = KNOCK * self._greatest(geoms, forces[:, 0]) + KNOCK_LEAST
        return self._merged(self._part[geoms], forces, contact)

    def _touching(self, geoms: Any) -> frozenset[int]:
        """The touching pairs of parts as numbers."""
        parts = self._part[geoms]
        return frozenset((parts.min(axis=1) * len(self._names) + parts.max(axis=1)).tolist())

    def _greatest(self, geoms: Any, forces: Array) -> float:
        """[N] Largest force at a single point of the robot."""
        return float(forces[self._robot[geoms].any(axis=1)].max(initial=0.0))

    def _merged(self, parts: Any, forces: Array, contact: Any) -> tuple[Contact, ...]:
        # MuJoCo's normal points from the first to the second geom, on which the force acts.
        swapped = parts[:, 0] < parts[:, 1]
        frame = contact.frame.reshape(-1, 3, 3) * np.where(swapped, -1.0, 1.0)[:, None, None]
        friction = forces[:, 1:2] * frame[:, 1] + forces[:, 2:3] * frame[:, 2]
        low, high = parts.min(axis=1).tolist(), parts.max(axis=1).tolist()
        found: dict[tuple[int, int], list[ContactPoint]] = {}
        depths: dict[tuple[int, int], float] = {}
        for a, b, at, normal, force, rubs, distance in zip(
            low, high, contact.pos.tolist(), frame[:, 0].tolist(), forces[:, 0].tolist(), friction.tolist(),
            contact.dist.tolist(), strict=True,
        ):  # fmt: skip
            point = ContactPoint(tuple(at), tuple(normal), force, tuple(rubs))
            if (a, b) in found:
                found[a, b].append(point)
                depths[a, b] = min(depths[a, b], distance)
            else:
                found[a, b], depths[a, b] = [point], distance
        names = self._names
        contacts = [
            Contact(names[a], names[b], sum([point.force for point in points]), depths[a, b], tuple(points))
            for (a, b), points in found.items()
        ]
        contacts.sort(key=_sides)
        return tuple(contacts)
