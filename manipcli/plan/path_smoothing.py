"""Rounding of a path's corners within a stated deviation, so that it can be passed without stopping.

Each corner p is replaced by a quintic Bezier curve that begins and ends at distance l from p on its two legs, tangent
to them and without curvature there (control points at l, 0.6 l and 0.2 l on each leg). Its middle is

    (1 (l) + 5 (0.6 l) + 10 (0.2 l)) / 32 = 0.1875 l  of  |u - w|

from p, where u and w are the unit vectors along the two legs, from the corner outwards: its largest deviation.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from manipcli.core.geometry import Array

_SAMPLES: Final = 12  # of a corner
_STRAIGHT: Final = 0.25  # rad or m between two points of a leg
_MIDDLE: Final = 0.1875
_HALF: Final = 0.48  # of a leg at most: two corners share it
_LEGS: Final = np.array([1.0, 0.6, 0.2])
_BINOMIAL: Final = np.array([1.0, 5.0, 10.0, 10.0, 5.0, 1.0])


def rounded(path: Array, deviation: float) -> Array:
    """(k, n) dense points on the path (m, n), its corners rounded by at most `deviation` [rad or m] (Euclidean)."""
    pieces = [path[:1]]
    for before, corner, after in zip(path[:-2], path[1:-1], path[2:], strict=True):
        pieces.append(_corner(before, corner, after, deviation))
    pieces.append(path[-1:])
    points = [pieces[0]]
    for first, second in pairwise(pieces):
        points += [_leg(first[-1], second[0]), second]
    return np.concatenate(points)


def _corner(before: Array, corner: Array, after: Array, deviation: float) -> Array:
    legs = before - corner, after - corner
    lengths = [float(np.linalg.norm(leg)) for leg in legs]
    u, w = (leg / length for leg, length in zip(legs, lengths, strict=True))
    apart = float(np.linalg.norm(u - w))
    cut = min(_HALF * min(lengths), deviation / (_MIDDLE * apart) if apart > 0.0 else np.inf)
    control = corner + cut * np.concatenate((_LEGS[:, None] * u, _LEGS[::-1, None] * w))
    t = np.linspace(0.0, 1.0, _SAMPLES + 1)[:, None]
    powers = np.arange(6)
    return np.asarray((_BINOMIAL * t**powers * (1.0 - t) ** (5 - powers)) @ control)


def _leg(a: Array, b: Array) -> Array:
    """Points between two ends, without them."""
    count = int(np.ceil(float(np.linalg.norm(b - a)) / _STRAIGHT))
    return a + (np.arange(1, count) / max(1, count))[:, None] * (b - a)
