"""Whether a body comes free of another one by going straight up: a block on a desk does, a drawer does not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from manipcli.core.geometry import Transform
from manipcli.model.collision import CollisionHit
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.proximity import coal_shape, overlap

HEIGHTS: Final = (0.01, 0.03, 0.05)
"""[m] above its place at which it must be free."""


def lifts_off(body: Body, X_WO: Transform, other: Body, X_WB: Transform) -> bool:
    """Whether `body`, raised from X_WO, does not meet `other` at X_WB."""
    for height in HEIGHTS:
        X_WR = Transform.of(xyz=(0.0, 0.0, height)) @ X_WO
        for a in body.geometries:
            for b in other.geometries:
                if overlap(coal_shape(a.shape), X_WR @ a.X_LS, coal_shape(b.shape), X_WB @ b.X_LS):
                    return False
    return True


def freed(scene: Scene, pose: Callable[[str], Transform], body: str, hit: CollisionHit) -> str:
    """The hint for a carried body that touches another part: lift it, or where that does not help, allow the contact.

    Args:
        scene: of the task.
        pose: X_WO of a body by its name.
        body: the carried body.
        hit: it and the other part.
    """
    other = hit.b if hit.a == body else hit.a
    known = {each.name for each in scene.bodies}
    if other not in known or lifts_off(scene.body(body), pose(body), scene.body(other), pose(other)):
        return f"`lift` '{body}' first"
    return f"add `allow: [[{body}, {other}]]` to this step, in which they may touch"
