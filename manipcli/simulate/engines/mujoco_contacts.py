"""Contacts of a MuJoCo world: one per touching pair of parts, with its points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from manipcli.model.state import Contact, ContactPoint
from manipcli.simulate.engines.conventions import KNOCK_LEAST, knock, sides


class _Pair(NamedTuple):
    """Two geoms that may touch.

    Attributes:
        names: of their parts, in alphabetical order.
        sign: 1 if MuJoCo's contact force acts on the first of these, -1 if on the second.
        robot: whether one is a link of the robot.
    """

    names: tuple[str, str]
    sign: float
    robot: bool


class Contacts:
    """Contacts of one world, as the last physics step computed them.

    Plain floats: numpy costs several times as much for a few contact points.

    Args:
        model, data: `MjModel` and `MjData`.
        parts: name of the part of each MuJoCo body.
    """

    def __init__(self, model: Any, data: Any, parts: Sequence[str]) -> None:
        self._data = data
        self._parts = [parts[body] for body in model.geom_bodyid]
        self._robot = np.array([name.startswith("robot/") for name in self._parts], dtype=np.bool_)
        self._known: dict[tuple[int, int], _Pair] = {}
        self._geoms, self._pairs = b"", frozenset[tuple[str, str]]()
        self._knock = KNOCK_LEAST

    def changed(self) -> bool:
        """Whether parts touch or part since `now`, or the force at a contact point of the robot grew a lot.

        Called at every tick, so the cheapest test comes first.
        """
        data = self._data
        if not data.ncon:
            return bool(self._pairs)
        contact = data.contact
        geoms = contact.geom
        if geoms.tobytes() != self._geoms and self._touching(geoms, contact.efc_address) != self._pairs:
            return True
        if max(data.efc_force.tolist(), default=0.0) <= self._knock:  # of any constraint
            return False
        address = contact.efc_address
        forces = data.efc_force[address[(address >= 0) & self._robot[geoms].any(axis=1)]]
        return bool(forces.max(initial=0.0) > self._knock)

    def peek(self) -> tuple[Contact, ...]:
        """As `now`, but `changed` compares with what it did before."""
        known = self._geoms, self._pairs, self._knock
        found = self.now()
        self._geoms, self._pairs, self._knock = known
        return found

    def now(self) -> tuple[Contact, ...]:
        """All contacts, sorted by the names of the parts; `changed` compares with them."""
        data = self._data
        if not data.ncon:
            self._geoms, self._pairs, self._knock = b"", frozenset(), KNOCK_LEAST
            return ()
        contact = data.contact
        geoms, force = contact.geom, data.efc_force.tolist()
        points: dict[tuple[str, str], list[ContactPoint]] = {}
        depths: dict[tuple[str, str], float] = {}
        greatest = 0.0
        for (first, second), row, at, frame, distance in zip(
            geoms.tolist(), contact.efc_address.tolist(), contact.pos.tolist(), contact.frame.tolist(),
            contact.dist.tolist(), strict=True,
        ):  # fmt: skip
            if row < 0:  # geoms that touch at a distance of 0 have no row among the constraints
                continue
            names, sign, robot = self._known.get((first, second)) or self._pair(first, second)
            nx, ny, nz, ax, ay, az, bx, by, bz = frame
            press = force[row]
            along, across = sign * force[row + 1], sign * force[row + 2]
            if robot and press > greatest:
                greatest = press
            friction = along * ax + across * bx, along * ay + across * by, along * az + across * bz
            point = ContactPoint(tuple(at), (sign * nx, sign * ny, sign * nz), press, friction)
            if names not in points:
                points[names], depths[names] = [point], distance
            else:
                points[names].append(point)
                if distance < depths[names]:
                    depths[names] = distance
        # A pair without force gets one without any change of the geoms: then `changed` compares the pairs.
        self._geoms = geoms.tobytes() if contact.efc_address.min() >= 0 else b""
        self._pairs = frozenset(points)
        self._knock = knock(greatest)
        contacts = [
            Contact(a, b, sum([point.force for point in between]), depths[a, b], tuple(between))
            for (a, b), between in points.items()
        ]
        if len(contacts) > 1:
            contacts.sort(key=sides)
        return tuple(contacts)

    def _touching(self, geoms: Any, address: Any) -> frozenset[tuple[str, str]]:
        """The names of the touching pairs of parts."""
        known = self._known
        return frozenset(
            (known.get((first, second)) or self._pair(first, second))[0]
            for (first, second), row in zip(geoms.tolist(), address.tolist(), strict=True)
            if row >= 0
        )

    def _pair(self, first: int, second: int) -> _Pair:
        """The facts of a pair of geoms, stored."""
        a, b = self._parts[first], self._parts[second]
        robot = bool(self._robot[first] or self._robot[second])
        # MuJoCo's normal points from the first to the second geom, on which its force acts.
        pair = _Pair((a, b), -1.0, robot) if a <= b else _Pair((b, a), 1.0, robot)
        self._known[first, second] = pair
        return pair
