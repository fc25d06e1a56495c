"""What everything stands on: drawn as a grid, whose height and extent do not depend on the floor of the task."""

from __future__ import annotations

from manipcli.replay.drawing import Drawing
from manipcli.replay.placing import Poses
from manipcli.scene.scene import Scene

FLOOR = "floor"
"""The kind of body that everything stands on."""


def floors_of(scene: Scene | None) -> frozenset[str]:
    """The bodies in whose place the grid is drawn."""
    return frozenset(body.name for body in scene.bodies if body.kind == FLOOR) if scene is not None else frozenset()


def ground_height(drawing: Drawing, poses: Poses, floors: frozenset[str]) -> float:
    """[m] of the grid: z = 0, or under what stands lower.

    Args:
        drawing: what is shown.
        poses: one instant.
        floors: frames that are not drawn.
    """
    index = {name: k for k, name in enumerate(drawing.frames)}
    lowest = (
        float(poses.X_WF(index[one.frame]).apply(one.surface.vertices)[:, 2].min())
        for one in drawing.layer("visual")
        if one.frame not in floors and len(one.surface.vertices)
    )
    return min(0.0, min(lowest, default=0.0))
