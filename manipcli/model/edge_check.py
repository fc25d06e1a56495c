"""Whether a straight line in joint space, or a polyline, is free of collisions, without a fixed step.

Between two checked configurations no part moves further than the distance that the checks found to be free (bounds:
`motion_bound`). A check with the margin m + c shows that every pair is at least m + c apart, so the pair stays more
than m - s apart as long as it moves by less than c + s in all, where s is the `SLACK` share of m. Checks are made with
increasing c (levels), halving what is not yet covered: few where there is room, many in a narrow place. The middle is
checked first, so that a blocked edge is found early.

A free edge keeps the margin m at the checked configurations, and m - s between them, anywhere.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.collision import CollisionQuery

SLACK: Final = 0.5
"""Share of the margin that may be missing between two checked configurations."""
LEAST: Final = 1e-3
"""[m] The least slack: with a margin of 0, parts may overlap by less than this between two checked configurations."""
LEVELS: Final = 0.0, 0.01, 0.04, 0.16
"""[m] Distances beyond the margin at which a check may be made, for the part that moves most."""
_SEGMENTS: Final = 4.0  # per radian of all joints together: the bound is then about a third above the motion
_MOST: Final = 48  # segments


class EdgeCheck:
    """Edges in the obstacles, load and margin of a query."""

    def __init__(self, query: CollisionQuery) -> None:
        self._query = query
        self._inflated = query.inflated(LEVELS)
        self._slack = max(LEAST, SLACK * query.margin)
        self.blocked: Array | None = None
        """(n) the configuration in collision that the last check found."""

    def touches(self, q: Array) -> bool:
        """Whether any parts are closer than the margin at `q` (n)."""
        return self._inflated.touches(q, 0)

    def free(self, a: Array, b: Array) -> bool:
        """Whether the line between two free configurations (n) is free."""
        count = int(min(_MOST, np.ceil(_SEGMENTS * float(np.abs(b - a).sum()))))
        if count == 0:
            return True
        return self.free_polyline(a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a)) is None

    def free_polyline(self, points: Array) -> float | None:
        """None where a polyline (k, n) between two free configurations is free.

        Else where it is blocked: the index of a point, and the share of the segment behind it.
        """
        inflated = self._inflated
        # Row c of `covered`: the motion along the polyline in units of what one check at level c covers.
        moved = inflated.bound.lengths(points) @ inflated.summed
        rates = [np.max(moved / (self._slack + c * inflated.weights), axis=1) for c in LEVELS]
        lines = [np.concatenate(([0.0], np.cumsum(rate))).tolist() for rate in rates]
        last = len(points) - 1

        def at(x: float) -> Array:
            k = min(int(x), last - 1)
            q: Array = points[k] + (x - k) * (points[k + 1] - points[k])
            return q

        # What is not yet covered, halved breadth first; the level is a guess from what was free beside it.
        gaps = [(_moved(lines[0], 0.0, 1.0), _moved(lines[0], float(last), -1.0), 0)]
        while gaps:
            halves = []
            for begin, end, guess in gaps:
                if begin >= end:
                    continue
                middle = _where(lines[0], 0.5 * (_value(lines[0], begin) + _value(lines[0], end)))
                wanted = 0
                while wanted <= guess and wanted < len(LEVELS) - 1 and not _covers(lines[wanted], begin, middle, end):
                    wanted += 1
                q = at(middle)
                level = self._level(q, wanted)
                if level is None:
                    self.blocked = q
                    return middle
                line = lines[level]
                halves.append((begin, _moved(line, middle, -1.0), level))
                halves.append((_moved(line, middle, 1.0), end, level))
            gaps = halves
        return None

    def _level(self, q: Array, wanted: int) -> int | None:
        """The highest level up to `wanted` at which `q` is free; None where it is in collision."""
        for level in range(wanted, -1, -1):
            if not self._inflated.touches(q, level):
                return level
        return None


def _value(line: list[float], x: float) -> float:
    """The piecewise linear function with `line[k]` at k."""
    k = min(int(x), len(line) - 2)
    return line[k] + (x - k) * (line[k + 1] - line[k])


def _where(line: list[float], y: float) -> float:
    """The inverse of `_value`, within the ends of the line."""
    k = min(max(bisect_right(line, y) - 1, 0), len(line) - 2)
    rise = line[k + 1] - line[k]
    return k + (min(max((y - line[k]) / rise, 0.0), 1.0) if rise > 0.0 else 1.0)


def _moved(line: list[float], x: float, much: float) -> float:
    """Where the motion from `x` is `much`."""
    return _where(line, _value(line, x) + much)


def _covers(line: list[float], begin: float, x: float, end: float) -> bool:
    """Whether a check at `x` covers everything from `begin` to `end`."""
    y = _value(line, x)
    return y - _value(line, begin) <= 1.0 and _value(line, end) - y <= 1.0
