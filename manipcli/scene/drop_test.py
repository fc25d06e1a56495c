"""Drop test: distance that a body falls until it touches another body."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.scene.body_shapes import BodyShape
from manipcli.scene.scene import Body
from manipcli.shapes.proximity import coal_shape, distance

FORMED: Final = ("urdf", "mesh")
"""Kinds of bodies whose top may be below that of their bounding box: a drawer, a shelf."""
SETTLED_SHIFT: Final = 0.01
"""[m] Largest displacement of a body while settling before a run."""
GRAZES: Final = 1e-5
"""[m] Smaller overlaps are ignored, so that a body flush with a wall slides down along it."""
LEAST: Final = 2e-4
"""[m] Least step down, and so the largest remaining gap: next to a wall all distances are small."""


def drop_height(falling: Body | BodyShape, X_WF: Transform, under: Body | BodyShape, X_WU: Transform) -> float | None:
    """Distance [m] that a body at X_WF falls until it touches `under`; None if it falls past it.

    Conservative advancement: a step of the current distance cannot cause contact. The body has landed when the least
    step further down would make it overlap.
    """
    pairs = [(a, b, coal_shape(a.shape), coal_shape(b.shape)) for a in falling.geometries for b in under.geometries]
    still = [X_WU @ b.X_LS for _, b, _, _ in pairs]
    fallen, step, deepest = 0.0, 0.0, top(falling, X_WF) - bottom(under, X_WU)
    while fallen < deepest:
        X_WN = Transform.of(xyz=(0.0, 0.0, -fallen)) @ X_WF
        apart = min(
            (
                distance(shape, X_WN @ a.X_LS, other, X_WB).distance
                for (a, _, shape, other), X_WB in zip(pairs, still, strict=True)
            ),
            default=np.inf,
        )
        if apart < -GRAZES:
            return fallen - step
        step = max(apart, LEAST)
        fallen += step
    return None


def top(body: Body | BodyShape, X_WO: Transform) -> float:
    """Height [m] of the highest corner of the bounding box."""
    return float(X_WO.apply(body.centre)[2] + np.abs(X_WO.R[2]) @ body.size / 2.0)


def bottom(body: Body | BodyShape, X_WO: Transform) -> float:
    """Height [m] of the lowest corner of the bounding box."""
    return float(X_WO.apply(body.centre)[2] - np.abs(X_WO.R[2]) @ body.size / 2.0)
