"""What need not be in view completely: floors, and large bodies that never move, such as the table."""

from __future__ import annotations

import numpy as np

from manipcli.render.drawing import FLOOR
from manipcli.render.placing import Placing, Poses
from manipcli.scene.scene import Scene

LARGE = 0.6
"""A fixed body with this share of the extent of robot and objects is a floor or table."""


def furniture(scene: Scene | None, placing: Placing, poses: Poses) -> frozenset[str]:
    """Names of the floors and tables of a scene; `poses`: of several states of `placing`."""
    if scene is None:
        return frozenset()
    first = poses.position.shape[-2] - len(scene.bodies)
    still = {first + k for k, body in enumerate(scene.bodies) if body.name in placing.still}
    moving = [k for k in range(1, poses.position.shape[-2]) if k not in still]
    points = poses.position[:, moving].reshape(-1, 3)
    extent = float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else np.inf
    return frozenset(
        body.name
        for body in scene.bodies
        if body.fixed and (body.kind == FLOOR or float(np.linalg.norm(body.size)) > LARGE * extent)
    )
