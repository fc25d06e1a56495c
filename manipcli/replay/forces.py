"""Contact forces of a run as arrows.

A log holds the pair and the force of each contact. Its point and direction are computed from the collision shapes as
the physics uses them: primitives, and convex hulls of meshes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.state import Contact
from manipcli.replay.drawing import link_frame
from manipcli.replay.placing import Poses
from manipcli.replay.playback import Playback
from manipcli.shapes.primitives import Geometry
from manipcli.shapes.proximity import coal_shape, distance

if TYPE_CHECKING:
    from manipcli.shapes.proximity import CollisionGeometry

LEAST = 0.05
"""Smallest drawn force [N]."""
LONGEST = 0.15
"""Length of the arrow of a strong force [m]."""
STRONG = 95.0
"""Percentile of the forces of a run that counts as strong, so that one impact does not hide the others."""


@dataclass(frozen=True, slots=True)
class Push:
    """A normal force [N] between two parts at a point (3,) [m] in the world; `direction` (3,) is the unit vector of the
    force on the movable body, or on the robot."""

    point: Array
    direction: Array
    force: float


class Forces:
    """The force arrows of a playback, computed on demand."""

    def __init__(self, playback: Playback, poses: Poses) -> None:
        self._contacts = playback.contacts
        self._poses = poses
        robot, scene = playback.robot, playback.scene
        links = robot.links if robot is not None else ()
        bodies = scene.bodies if scene is not None else ()
        geometries = {link_frame(link.name): link.collisions for link in links}
        geometries |= {body.name: body.geometries for body in bodies}
        self._frame = {name: k for k, name in enumerate(geometries, start=1)}
        self._movable = {body.name for body in bodies if not body.fixed}
        self._geometries = geometries
        self._shapes: dict[str, list[tuple[Transform, CollisionGeometry]]] = {}
        strong = [contact.force for contacts in self._contacts for contact in contacts if contact.force > LEAST]
        self.scale = LONGEST / float(np.percentile(strong, STRONG)) if strong else 0.0
        """Length of an arrow per force [m/N]."""

    def at(self, k: int) -> tuple[Push, ...]:
        """The contact forces at the k-th time."""
        found = (self._push(contact, k) for contact in self._contacts[k] if contact.force > LEAST)
        return tuple(push for push in found if push is not None)

    def _push(self, contact: Contact, k: int) -> Push | None:
        X_WA, X_WB = (self._poses_of(name, k) for name in (contact.a, contact.b))
        found = [
            distance(first, X_WA @ X_AS, second, X_WB @ X_BS)
            for X_AS, first in self._of(contact.a)
            for X_BS, second in self._of(contact.b)
        ]
        if not found:
            return None
        nearest = min(found, key=lambda result: result.distance)
        point, normal = nearest.point, nearest.normal
        if not np.isfinite(nearest.distance) or not np.isfinite(normal).all():
            return None
        # The normal points from the first part to the second; the force on the first has the opposite sign.
        on_second = contact.a not in self._movable and (contact.b in self._movable or contact.b.startswith("robot/"))
        return Push(point, normal if on_second else -normal, contact.force)

    def _of(self, name: str) -> list[tuple[Transform, CollisionGeometry]]:
        if name not in self._shapes:
            self._shapes[name] = list(_usable(self._geometries.get(name, ())))
        return self._shapes[name]

    def _poses_of(self, name: str, k: int) -> Transform:
        frame = self._frame.get(name, 0)
        return Transform.of(xyz=self._poses.position[k, frame], quat_xyzw=self._poses.quat_xyzw[k, frame])


def _usable(geometries: Sequence[Geometry]) -> list[tuple[Transform, CollisionGeometry]]:
    """The shapes that can be read, without meshes whose file is missing."""
    found = []
    for geometry in geometries:
        try:
            found.append((geometry.X_LS, coal_shape(geometry.shape)))
        except ValueError:
            continue
    return found
