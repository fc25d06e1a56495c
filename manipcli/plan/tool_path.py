"""Curved paths of the tool as poses: circular arcs, and straight segments with rounded corners.

The orientation changes at a constant rate over the length of the path, on the shortest arc, as on a straight line.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen, matrix_from_axis_angle
from manipcli.plan.path import ANGULAR_STEP, LINEAR_STEP
from manipcli.plan.pose_error import rotation_vector

_FEWEST: Final = 12  # points on an arc
_FINE: Final = 100  # points on a rounded corner, before they are spaced evenly
_CONTROLS: Final = 1.0, 0.5, 0.1  # of the distance from the corner; of those tried, the quickest motions
_BINOMIAL: Final = 1, 5, 10, 10, 5, 1
DISTINCT: Final = 1e-3
"""[m] Least distance of two points of an arc: nearer ones do not define its plane."""
_FLAT: Final = 1e-6  # m: three points nearer to a line than this have no arc


def arc(X_WA: Transform, via: Array, X_WB: Transform) -> tuple[Transform, ...]:
    """Poses on the circular arc from A through the point `via` (3,) to B.

    Raises:
        NotPlannable: the three points are on a line, or two of them are equal.
    """
    a, b, c = X_WA.p, via, X_WB.p
    u, w = b - a, c - a
    for names, apart in ((("the start", "`via`"), u), (("the start", "the end"), w), (("`via`", "the end"), c - b)):
        if float(np.linalg.norm(apart)) < DISTINCT:
            message = f"{names[0]} and {names[1]} of the arc are less than {1000 * DISTINCT:g} mm apart"
            raise NotPlannable(message, hint="an arc needs three different points; a whole circle is two arcs")
    normal = np.cross(u, w)
    square = float(normal @ normal)
    if square < (_FLAT * float(np.linalg.norm(w))) ** 2:
        raise NotPlannable(
            "the start, `via` and the end of the arc are on a line",
            hint="move `via` off the line, or use `path: linear`",
        )
    # Circumcentre: a + ((u x w) x u |w|^2 + w x (u x w) |u|^2) / (2 |u x w|^2)
    centre = a + (np.cross(normal, u) * (w @ w) + np.cross(w, normal) * (u @ u)) / (2.0 * square)
    e1 = a - centre
    radius = float(np.linalg.norm(e1))
    e1 /= radius
    e2 = np.cross(normal / np.sqrt(square), e1)
    angle = float(np.arctan2((c - centre) @ e2, (c - centre) @ e1)) % (2.0 * np.pi)
    count = _count(radius * angle, X_WA, X_WB)
    turned = np.linspace(0.0, angle, count + 1)[:, None]
    return _oriented(centre + radius * (np.cos(turned) * e1 + np.sin(turned) * e2), X_WA, X_WB)


def blended(X_WA: Transform, vias: Sequence[tuple[Array, float]], X_WB: Transform) -> tuple[Transform, ...]:
    """Poses on straight segments from A by via points to B, with rounded corners.

    Args:
        X_WA, X_WB: first and last pose.
        vias: points (3,) [m], each with the distance from it at which the path leaves the segments [m].

    Raises:
        NotPlannable: two points are equal, the path turns back, or two rounded corners overlap.
    """
    corners = [X_WA.p, *(point for point, _ in vias), X_WB.p]
    reach = [0.0, *(radius for _, radius in vias), 0.0]
    lengths = [float(np.linalg.norm(b - a)) for a, b in pairwise(corners)]
    for k, length in enumerate(lengths):
        if length < _FLAT:
            raise NotPlannable(f"points {k} and {k + 1} of the tool's path are equal", hint="remove one of them")
        if reach[k] + reach[k + 1] > length + 1e-9:
            raise NotPlannable(
                f"the rounded corners overlap between points {k} and {k + 1} of the tool's path, {length:.3f} m apart",
                hint=f"make `radius` smaller: both together at most {length:.3f} m",
            )
    along = [(b - a) / length for (a, b), length in zip(pairwise(corners), lengths, strict=True)]
    points = [corners[0][None]]
    for k, (before, after) in enumerate(pairwise(along), start=1):
        points.append(_corner(corners[k], reach[k], before, after, k))
    points.append(corners[-1][None])
    whole = np.vstack(points)
    walked = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(whole, axis=0), axis=1))))
    # Evenly spaced, with some points on each arc: the curve through uneven waypoints is less smooth.
    count = max(_count(walked[-1], X_WA, X_WB), int(np.ceil(_FEWEST * walked[-1] / (2.0 * min(reach[1:-1])))))
    at = np.linspace(0.0, walked[-1], count + 1)
    return _oriented(np.stack([np.interp(at, walked, axis) for axis in whole.T], axis=1), X_WA, X_WB)


def _corner(corner: Array, reach: float, before: Array, after: Array, k: int) -> Array:
    """(m, 3) from `reach` before the corner to as far behind: a Bezier curve of order 5, without curvature at its ends.

    Three of its control points are on each segment. A circular arc would need jumps of the acceleration.
    """
    turn = float(np.arccos(np.clip(before @ after, -1.0, 1.0)))
    if turn < 1e-6:
        return corner[None]
    if turn > np.pi - 1e-3:
        raise NotPlannable(f"the tool's path turns back at point {k}", hint="use two steps, or another via point")
    t = np.linspace(0.0, 1.0, _FINE + 1)[:, None]
    controls = [corner - share * reach * before for share in _CONTROLS]
    controls += [corner + share * reach * after for share in reversed(_CONTROLS)]
    return np.asarray(sum(_BINOMIAL[i] * t**i * (1.0 - t) ** (5 - i) * each for i, each in enumerate(controls)))


def _count(length: float, X_WA: Transform, X_WB: Transform) -> int:
    rotation = float(np.linalg.norm(rotation_vector(X_WA.R.T @ X_WB.R)))
    return max(_FEWEST, int(np.ceil(max(length / LINEAR_STEP, rotation / ANGULAR_STEP) - 1e-9)))


def _oriented(points: Array, X_WA: Transform, X_WB: Transform) -> tuple[Transform, ...]:
    """Poses at points (m, 3), of which the ends are those of A and B."""
    walked = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))))
    rotation = rotation_vector(X_WA.R.T @ X_WB.R)
    whole = float(np.linalg.norm(rotation))
    axis = rotation / whole if whole > 1e-12 else np.array([0.0, 0.0, 1.0])
    between = [
        Transform(R=frozen(X_WA.R @ matrix_from_axis_angle(axis, float(share) * whole)), p=frozen(p))
        for p, share in zip(points[1:-1], walked[1:-1] / walked[-1], strict=True)
    ]
    return (X_WA, *between, X_WB)
