"""Positions of bodies over time: bounding box centre, lowest and highest point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manipcli.core.geometry import Array, matrix_from_quat, rotate
from manipcli.model.state import WorldState, body_pose
from manipcli.scene.scene import Scene


def centres(scene: Scene, states: WorldState, name: str) -> Array:
    """(T, 3) or (3,) centre of a body's bounding box in the world [m]."""
    X_WO = body_pose(scene, states, name)
    return np.asarray(X_WO.position + rotate(X_WO.quat_xyzw, scene.body(name).centre))


def lowest(scene: Scene, states: WorldState, name: str) -> Array:
    """(T,) or () height of the lowest corner of a body's bounding box in the world [m]."""
    return np.asarray(centres(scene, states, name)[..., 2] - _half_height(scene, states, name))


def highest(scene: Scene, states: WorldState, name: str) -> Array:
    """(T,) or () height of the highest corner of a body's bounding box in the world [m]."""
    return np.asarray(centres(scene, states, name)[..., 2] + _half_height(scene, states, name))


def _half_height(scene: Scene, states: WorldState, name: str) -> Array:
    """Half the height of the rotated box: sum_i |z . e_i| size_i / 2, with the directions e_i of its edges."""
    R_WO = matrix_from_quat(body_pose(scene, states, name).quat_xyzw)
    return np.asarray(np.abs(R_WO[..., 2, :]) @ scene.body(name).size / 2.0)


def point_text(points: Array, k: int) -> str:
    """The point of tick `k` as `[0.75, 0.002, 0.4] m`; points: (T, 3), or (3,) for all ticks."""
    return vector_text(points if points.ndim == 1 else points[k])


def vector_text(point: Sequence[float] | Array) -> str:
    """A vector [m] as text, rounded to the millimetre."""
    return f"[{', '.join(f'{round(float(x), 3) + 0.0:g}' for x in point)}] m"
