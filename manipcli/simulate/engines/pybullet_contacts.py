"""PyBullet's contact points as contacts: one a touching pair of parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import attrgetter

from manipcli.model.state import Contact

Vector = tuple[float, float, float]
Pair = tuple[int, int, int, int]
"""Body a, body b, link of a, link of b."""
ContactPoint = tuple[int, int, int, int, int, Vector, Vector, Vector, float, float, float, Vector, float, Vector]
"""What PyBullet says of a contact point: a flag, bodies and links a and b, places on a and b, the normal on b, the
distance, the normal force on a, and twice: friction on a along a direction."""
_sides = attrgetter("a", "b")


def touching_pairs(points: Sequence[ContactPoint]) -> set[Pair]:
    """The pairs of links that touch."""
    return {point[1:5] for point in points if point[9] > 0.0 or point[8] <= 0.0}


def greatest_force(points: Sequence[ContactPoint], body: int) -> float:
    """[N] of a single point of this body."""
    return max([point[9] for point in points if point[1] == body or point[2] == body], default=0.0)


class ContactMerger:
    """Sums up contact points. `parts`: the name of every (body, link); a body's base is its link -1."""

    def __init__(self, parts: Mapping[tuple[int, int], str]) -> None:
        self._parts = parts
        self._known: dict[Pair, tuple[str, str]] = {}

    def merged(self, points: Sequence[ContactPoint]) -> tuple[Contact, ...]:
        """One contact a touching pair; points that are near but apart (positive distance, no force) are dropped."""
        forces: dict[Pair, float] = {}
        depths: dict[Pair, float] = {}
        for point in points:
            distance, force = point[8], point[9]
            if force > 0.0 or distance <= 0.0:
                pair = point[1:5]
                if pair not in forces:
                    forces[pair], depths[pair] = force, distance
                else:
                    forces[pair] += force
                    if distance < depths[pair]:
                        depths[pair] = distance
        if not forces:
            return ()
        known = self._known
        found = []
        for pair, force in forces.items():
            a, b = known.get(pair) or self._names(pair)
            found.append(Contact(a, b, force, depths[pair]))
        if len(found) > 1:
            found.sort(key=_sides)
        return tuple(found)

    def _names(self, pair: Pair) -> tuple[str, str]:
        """The two names in their order, remembered."""
        body_a, body_b, link_a, link_b = pair
        a, b = self._parts[body_a, link_a], self._parts[body_b, link_b]
        names = self._known[pair] = (a, b) if a <= b else (b, a)
        return names
