"""A place beside a body, with a given gap between the two."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.scene.scene import Body
from manipcli.shapes.proximity import coal_shape, distance

SIDES: Final = {
    "front": (1.0, 0.0, 0.0), "behind": (-1.0, 0.0, 0.0), "left": (0.0, 1.0, 0.0), "right": (0.0, -1.0, 0.0),
}  # fmt: skip
"""Directions in the frame of a body, as in REP 103: x to the front, y to the left."""
EXACT: Final = 1e-6
"""[m] Tolerance of the gap."""
STEPS: Final = 2000
"""Most steps towards the other body."""


def beside(body: Body, R: Array, z: float, other: Body, X_WU: Transform, side: str, gap: float) -> Transform | None:
    """X_WG of a body on one side of another, its middle beside that of the other.

    Conservative advancement from far away: a step of the current distance minus `gap` cannot make it smaller than that.

    Args:
        body, R, z: the body, its orientation (3, 3) and the height [m] of its frame.
        other, X_WU: the other body, which is upright.
        side: of `SIDES`, in the frame of the other body.
        gap: [m] smallest distance between the two.

    Returns:
        The pose; None where it passes above or below the other.
    """
    d = X_WU.R @ np.array(SIDES[side])
    d = np.array([d[0], d[1], 0.0]) / np.hypot(d[0], d[1])
    middle = X_WU.apply(other.centre) - R @ body.centre
    pairs = [(a, b, coal_shape(a.shape), coal_shape(b.shape)) for a in body.geometries for b in other.geometries]
    far = float(np.linalg.norm(body.size) + np.linalg.norm(other.size)) / 2 + gap + EXACT

    def at(s: float) -> Transform:
        p = middle + s * d
        return Transform.of(xyz=(p[0], p[1], z), R=R)

    for _ in range(STEPS):
        X_WG = at(far)
        apart = min(distance(m, X_WG @ a.X_LS, n, X_WU @ b.X_LS).distance for a, b, m, n in pairs)
        if apart - gap < EXACT:
            return X_WG
        far -= apart - gap
        if far < 0.0:
            return None
    return None
