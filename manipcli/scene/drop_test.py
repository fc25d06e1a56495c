"""How far a body falls before it meets another one, shape against shape."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.scene.body_shapes import BodyShape
from manipcli.scene.scene import Body
from manipcli.shapes.proximity import coal_shape, distance

FORMED: Final = ("urdf", "mesh")
"""Kinds of bodies whose top need not be that of their bounding box: a drawer, a shelf."""
GRAZES: Final = 1e-5
"""[m] What overlaps by no more has not met: a thing flush with a wall slides down along it."""
LEAST: Final = 2e-4
"""[m] Least step down, and so the greatest gap that is left: beside a wall distances are small on the whole way."""


def landing(falling: Body | BodyShape, X_WF: Transform, under: Body | BodyShape, X_WU: Transform) -> float | None:
    """[m] how far a body at X_WF falls until it meets `under`; None where it falls past it.

    Conservative advancement: a step as long as the distance meets nothing, whichever way it goes. It has landed where
    the least step further down would make it overlap.
    """
    pairs = [(a, b, coal_shape(a.shape), coal_shape(b.shape)) for a in falling.geometries for b in under.geometries]
    still = [X_WU @ b.X_LS for _, b, _, _ in pairs]
    fallen, step, deepest = 0.0, 0.0, _top(falling, X_WF) - _bottom(under, X_WU)
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


def _top(body: Body | BodyShape, X_WO: Transform) -> float:
    """Height [m] of the highest corner of its bounding box."""
    return float(X_WO.apply(body.centre)[2] + np.abs(X_WO.R[2]) @ body.size / 2.0)


def _bottom(body: Body | BodyShape, X_WO: Transform) -> float:
    return float(X_WO.apply(body.centre)[2] - np.abs(X_WO.R[2]) @ body.size / 2.0)
