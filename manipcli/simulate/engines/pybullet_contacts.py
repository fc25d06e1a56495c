"""Conversion of PyBullet's contact points to contacts: one per touching pair of parts."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from operator import itemgetter

from manipcli.model.state import Contact, ContactPoint
from manipcli.simulate.engines.conventions import KNOCK_LEAST, knock, sides

Vector = tuple[float, float, float]
Pair = tuple[int, int, int, int]
"""Body a, body b, link of a, link of b."""
BulletPoint = tuple[int, int, int, int, int, Vector, Vector, Vector, float, float, float, Vector, float, Vector]
"""PyBullet's tuple for a contact point: a flag, bodies and links a and b, places on a and b, the normal on b (towards
a), the distance, the normal force on a, and twice: friction on a along a direction."""
_force = itemgetter(9)


class ContactWatch:
    """Detects changes of the touching links, and impacts on `body`."""

    def __init__(self, body: int) -> None:
        self._body = body
        self._pairs: list[Pair] = []
        self._knock = KNOCK_LEAST

    def changed(self, points: Sequence[BulletPoint]) -> bool:
        """Whether they changed since `seen`. Called at every tick, so the cheapest test comes first."""
        pairs = _touching(points)
        if pairs != self._pairs and set(pairs) != set(self._pairs):
            return True
        return max(map(_force, points), default=0.0) > self._knock and self._greatest(points) > self._knock

    def seen(self, points: Sequence[BulletPoint]) -> None:
        """Set the points to compare with."""
        self._pairs = _touching(points)
        self._knock = knock(self._greatest(points))

    def _greatest(self, points: Sequence[BulletPoint]) -> float:
        """[N] Largest force at a single point of the body."""
        body = self._body
        return max([point[9] for point in points if point[1] == body or point[2] == body], default=0.0)


def _touching(points: Sequence[BulletPoint]) -> list[Pair]:
    """The pairs of links that touch, one per point."""
    return [point[1:5] for point in points if point[9] > 0.0 or point[8] <= 0.0]


class ContactMerger:
    """Merges contact points into contacts.

    Args:
        parts: the name of every (body, link); a body's base is its link -1.
        still: immovable parts: a robot on the floor has no contact with it.
    """

    def __init__(self, parts: Mapping[tuple[int, int], str], *, still: Collection[tuple[int, int]] = ()) -> None:
        self._parts = parts
        self._still = frozenset((a, b, k, m) for a, k in still for b, m in still)
        self._known: dict[Pair, tuple[str, str, float]] = {}

    def merged(self, points: Sequence[BulletPoint]) -> tuple[Contact, ...]:
        """One contact per touching pair; points that are apart (positive distance, no force) are dropped."""
        forces: dict[Pair, float] = {}
        depths: dict[Pair, float] = {}
        touching: dict[Pair, list[BulletPoint]] = {}
        for point in points:
            distance, force = point[8], point[9]
            if force > 0.0 or distance <= 0.0:
                pair = point[1:5]
                if pair not in forces:
                    if pair in self._still:
                        continue
                    forces[pair], depths[pair], touching[pair] = force, distance, [point]
                else:
                    forces[pair] += force
                    touching[pair].append(point)
                    if distance < depths[pair]:
                        depths[pair] = distance
        if not forces:
            return ()
        known = self._known
        found = []
        for pair, force in forces.items():
            a, b, side = known.get(pair) or self._names(pair)
            found.append(Contact(a, b, force, depths[pair], tuple([_point(one, side) for one in touching[pair]])))
        if len(found) > 1:
            found.sort(key=sides)
        return tuple(found)

    def _names(self, pair: Pair) -> tuple[str, str, float]:
        """The two names in alphabetical order, and -1.0 if that swaps Bullet's order, else 1.0; cached."""
        body_a, body_b, link_a, link_b = pair
        a, b = self._parts[body_a, link_a], self._parts[body_b, link_b]
        names = self._known[pair] = (a, b, 1.0) if a <= b else (b, a, -1.0)
        return names


def _point(point: BulletPoint, side: float) -> ContactPoint:
    """The point halfway between the two surfaces; `side` is -1.0 if Bullet's body a is the contact's `b`."""
    _, _, _, _, _, (ax, ay, az), (bx, by, bz), (nx, ny, nz), _, force, f, (ux, uy, uz), g, (vx, vy, vz) = point
    f, g = side * f, side * g
    return ContactPoint(
        (0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz)),
        (side * nx, side * ny, side * nz),
        force,
        (f * ux + g * vx, f * uy + g * vy, f * uz + g * vz),
    )
