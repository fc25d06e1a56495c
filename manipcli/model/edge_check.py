"""Whether a straight line in joint space, or a polyline, is free of collisions, without a fixed step.

Between two checked configurations no part moves further than the distance that the checks found to be free (bounds:
`motion_bound`). A check with the margin m + c shows that every pair is at least m + c apart, so the pair stays more
than m - s apart as long as it moves by less than c + s in all, where s is the `SLACK` share of m. Checks are made with
increasing c (levels), halving what is not yet covered: few where there is room, many in a narrow place. The middle is
checked first, so that a blocked edge is found early.

A free edge keeps the margin m at the checked configurations, and m - s between them, anywhere.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.work import EDGE
from manipcli.model.collision import CollisionQuery

SLACK: Final = 0.5
"""Share of the margin that may be missing between two checked configurations."""
LEAST: Final = 1e-3
"""[m] The least slack: with a margin of 0, parts may overlap by less than this between two checked configurations."""
LEVELS: Final = 0.0, 0.01, 0.04, 0.16
"""[m] Distances beyond the margin at which a check may be made, for the part that moves most."""
_SEGMENTS: Final = 4.0  # per radian of all joints together: the bound is then about a third above the motion
_MOST: Final = 48  # segments
_FIRST: Final = 0.5, 0.25, 0.75  # shares of an edge that are checked before its bounds are computed
_CHORD: Final = 0.1  # of the slack: how far points of a polyline may be off its simplification
_SHORT: Final = 0.2  # rad or m, of all joints together: below, they are not


class EdgeCheck:
    """Edges in the obstacles, load and margin of a query."""

    def __init__(self, query: CollisionQuery, *, slack: float | None = None) -> None:
        """`slack` [m]: what may be missing of the margin between checked configurations; by default `SLACK` of it."""
        self._inflated = query.inflated(LEVELS)
        self._work = query.kinematics.work
        self._slack = max(LEAST, SLACK * query.least_margin) if slack is None else slack
        self._covered = (1.0 - _CHORD) * self._slack + np.array(LEVELS)[:, None, None] * self._inflated.weights
        self.blocked: Array | None = None
        """(n) the configuration in collision that the last check found."""

    def touches(self, q: Array) -> bool:
        """Whether any parts are closer than the margin at `q` (n)."""
        return self._inflated.touches(q, 0)

    def free(self, a: Array, b: Array) -> bool:
        """Whether the line between two free configurations (n) is free."""
        total = float(np.abs(b - a).sum())
        if total == 0.0:
            return True
        if total > _SHORT:
            for share in _FIRST:
                q = a + share * (b - a)
                if self._inflated.touches(q, 0):
                    self.blocked = q
                    return False
        segments = min(_MOST, math.ceil(_SEGMENTS * total))
        moved = self._inflated.bound.along(a, b, segments)
        return self._uncovered(a + np.linspace(0.0, 1.0, segments + 1)[:, None] * (b - a), moved) is None

    def free_polyline(self, points: Array) -> int | None:
        """None where a polyline (k, n) between two free configurations is free; else the index of a point nearest to
        where it is blocked.
        """
        kept = self._corners(points)
        where = self._uncovered(points[kept], self._inflated.bound.lengths(points[kept]))
        if where is None or self.blocked is None:
            return None
        low = min(int(where), len(kept) - 2)
        near = points[kept[low] : kept[low + 1] + 1]
        return kept[low] + int(np.argmin(np.abs(near - self.blocked).sum(axis=1)))

    def _corners(self, points: Array) -> list[int]:
        """Indices of points (k, n) whose chords keep within `_CHORD` of the slack of all points, for every part."""
        reach = self._inflated.bound.reach.max(axis=0, initial=0.0)
        kept, spans = [0], [(0, len(points) - 1)]
        while spans:
            low, high = spans.pop()
            chord = points[high] - points[low]
            square = float(chord @ chord)
            away = points[low + 1 : high] - points[low]
            share = np.clip(away @ chord / square, 0.0, 1.0) if square > 0.0 else np.zeros(len(away))
            off = np.abs(away - share[:, None] * chord) @ reach
            if high - low > 1 and float(off.max()) > _CHORD * self._slack:
                middle = (low + high) // 2
                spans += [(middle, high), (low, middle)]
            else:
                kept.append(high)
        return kept

    def _uncovered(self, points: Array, lengths: Array) -> float | None:
        """None where the polyline is free; else where it is blocked: the index of a point, and the share behind it.

        `lengths` (k - 1, movers) are bounds of the motion on each segment.
        """
        self._work.add(EDGE)
        moved = lengths @ self._inflated.summed
        # Along the polyline at every level: the motion in units of what one check at that level covers.
        rates = np.max(moved / self._covered, axis=2, initial=0.0)
        lines = np.concatenate((np.zeros((len(LEVELS), 1)), np.cumsum(rates, axis=1)), axis=1).tolist()
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
