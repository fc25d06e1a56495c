"""Inertia that a joint of a scene moves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.scene.joints import SceneJoint, carried_by
from manipcli.scene.scene import Scene


def moved_inertia(scene: Scene, joint: SceneJoint, pose: Callable[[str], Transform] | None = None) -> float:
    """[kg] or [kg m2] of all bodies that the joint moves, along or about its axis; joints further on are held.

    Args:
        scene: with the joint.
        joint: of the scene.
        pose: X_WO of a body. Default: at the start.
    """
    at = pose or (lambda name: scene.body(name).X_WO)
    moved = [scene.body(name) for name in (joint.child, *carried_by(scene.joints, joint.child))]
    if joint.slides:
        return sum(body.mass for body in moved)
    X_WC = at(joint.child)
    axis, total = X_WC.R @ joint.axis, 0.0  # the axis is the same in J and in C
    for body in moved:
        X_WI = at(body.name) @ body.X_OI
        arm = np.cross(axis, X_WI.p - X_WC.p)
        total += float(axis @ X_WI.R @ body.inertia @ X_WI.R.T @ axis + body.mass * arm @ arm)
    return total
