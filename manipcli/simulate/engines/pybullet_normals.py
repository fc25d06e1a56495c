"""Fresh contact normals for bodies that turn in a hand.

Bullet keeps up to four points of a pair, and a step computes only one of them anew. The others follow the surfaces, but
keep the normal that they had in the world: in a hand that turns a cup by 120 degrees, points are left whose normals are
wrong by as much. They squeeze the cup along its wall, and can carry it when the hand has opened.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Final

from manipcli.core.geometry import Array
from manipcli.simulate.engines.pybullet_contacts import BulletPoint

TURN: Final = math.radians(1.0)
"""Angle [rad] that a body turns between two looks at its normals, and thus their largest error but for one look."""
_COS = math.cos(TURN / 2.0)
_GROUP, _MASK = 1, -1
"""Bullet's own for what can move."""

Part = tuple[int, int]
"""Bullet's numbers of a body and of a link."""


class Normals:
    """Lets Bullet forget the contact points of a body whose normals did not turn with it.

    A normal that is the same to the last bit after its body turned by `TURN` was not computed anew. Where the other
    part stands still this can be right, as for a ball that rolls on a desk; such pairs are left alone.

    Args:
        p, client: PyBullet and its world.
        parts: of each movable body, by row.
        still: parts that never move.
    """

    def __init__(self, p: ModuleType, client: int, parts: Mapping[int, Part], still: Sequence[Part]) -> None:
        self._p, self._client, self._parts, self._still = p, client, parts, frozenset(still)
        self._looked = dict.fromkeys(parts, (0.0, 0.0, 0.0, 0.0))
        self._before: dict[int, frozenset[tuple[object, ...]]] = dict.fromkeys(parts, frozenset())

    def turned(self, quat_xyzw: Array) -> list[int]:
        """Rows of the bodies, with orientations (m, 4), that have turned by `TURN` since they were last looked at."""
        found = []
        for row, (x, y, z, w) in enumerate(quat_xyzw.tolist()):
            a, b, c, d = self._looked[row]
            if abs(a * x + b * y + c * z + d * w) < _COS:
                self._looked[row] = (x, y, z, w)
                found.append(row)
        return found

    def look(self, rows: Sequence[int], points: Sequence[BulletPoint]) -> None:
        """Forget the points of these bodies if one of their normals is stale."""
        for row in rows:
            part = self._parts[row]
            now = frozenset(
                (*ends, point[7])
                for point in points
                if part in (ends := ((point[1], point[3]), (point[2], point[4]))) and self._still.isdisjoint(ends)
            )
            if now & self._before[row]:
                # Bullet takes the part out of its broad phase and puts it back, with the points of its pairs.
                self._p.setCollisionFilterGroupMask(*part, _GROUP, _MASK, physicsClientId=self._client)
                now = frozenset()
            self._before[row] = now
