"""What is free for the arm in a planning state: the predicates of a path problem, and what blocked them.

While the hand moves, its joints are at no known place of a path. A configuration of the arm counts as free if it is
free with the hand at the start, at the end and in the middle of its own motion. The timed motion of both is checked in
the end (`sweep`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.collision import CollisionHit, CollisionQuery, Pair
from manipcli.model.configuration import leads, with_mimics
from manipcli.model.edge_check import EdgeCheck
from manipcli.model.robot import RobotModel

_KEPT = 200  # blocked configurations that are examined when there is no path


class FreeSpace:
    """Configurations of some joints, the others at given positions."""

    def __init__(self, robot: RobotModel, query: CollisionQuery, names: Sequence[str], others: Sequence[Array]) -> None:
        """
        Args:
            robot, query: what moves, and what is checked.
            names: the joints of the path (m).
            others: positions (n) of all joints; a configuration is free if it is with each of them.
        """
        self._robot = robot
        self._query = query
        self._edges = EdgeCheck(query)
        self._columns = list(robot.indices(tuple(names)))
        self._others = [np.array(q) for q in others]
        self._mimics = leads(robot, names)
        self._blocked: list[Array] = []
        self.edges = 0
        """Number of edges that were checked."""

    def whole(self, q: Array, other: Array) -> Array:
        """(..., n) all joints, with those of the path at `q` (..., m) and the rest as in `other` (n)."""
        position = np.broadcast_to(other, (*q.shape[:-1], len(other))).copy()
        position[..., self._columns] = q
        return np.asarray(with_mimics(self._robot, position)) if self._mimics else position

    def valid(self, q: Array) -> bool:
        """Whether the configuration is free."""
        for other in self._others:
            position = self.whole(q, other)
            if self._edges.touches(position):
                self._note(position)
                return False
        return True

    def edge(self, a: Array, b: Array) -> bool:
        """Whether the straight line between two free configurations is free."""
        self.edges += 1
        for other in self._others:
            if not self._edges.free(self.whole(a, other), self.whole(b, other)):
                assert self._edges.blocked is not None
                self._note(self._edges.blocked)
                return False
        return True

    def first_hit(self, a: Array, b: Array) -> CollisionHit | None:
        """The first contact on the line from a to b, which need not be free at its ends."""
        count = max(1, int(np.ceil(float(np.max(np.abs(b - a))) / 0.02)))
        for share in np.linspace(0.0, 1.0, count + 1).tolist():
            for other in self._others:
                hit = self._query.check(self.whole(a + share * (b - a), other))
                if hit is not None:
                    return hit
        return None

    def commonest(self) -> tuple[Pair, float] | None:
        """The pair that blocked most of what was checked, and its share."""
        if not self._blocked:
            return None
        deepest = [self._query.check(q) for q in self._blocked]
        counts = Counter((hit.a, hit.b) for hit in deepest if hit is not None)
        if not counts:
            return None
        pair, count = min(counts.items(), key=lambda item: (-item[1], item[0]))
        return pair, count / sum(counts.values())

    def _note(self, position: Array) -> None:
        if len(self._blocked) < _KEPT:
            self._blocked.append(position)
