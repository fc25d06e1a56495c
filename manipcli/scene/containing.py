"""Which bodies have their centre in the interior of a container."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.scene.scene import Body, Interior
from manipcli.shapes.primitives import Cylinder


def within(interior: Interior, points: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(k,) whether points (k, 3) [m] in the frame O of a container are in its interior."""
    local = (points - interior.X_OS.p) @ interior.X_OS.R
    if interior.walls is not None:
        low = (local[:, 2] > interior.floor) & (local[:, 2] < interior.rim)
        return np.asarray(low & (interior.walls.room(local) > 0.0))
    if isinstance(interior.shape, Cylinder):
        level = np.hypot(local[:, 0], local[:, 1]) < interior.shape.radius
        return np.asarray(level & (np.abs(local[:, 2]) < interior.shape.length / 2.0))
    return np.asarray(np.all(np.abs(local) < np.array(interior.shape.size) / 2.0, axis=1))


def contains(container: Body, X_WC: Transform, body: Body, X_WO: Transform) -> bool:
    """Whether the centre of a body at X_WO is in the interior of a container at X_WC."""
    if container.interior is None or container.name == body.name:
        return False
    return bool(within(container.interior, X_WC.inverse().apply(X_WO.apply(body.centre))[None])[0])
