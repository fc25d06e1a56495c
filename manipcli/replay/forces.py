"""Contacts as arrows: where two parts touch, and which way they push.

A log says which parts touch and how strongly; where follows from their shapes, which are taken as the physics takes
them: primitives, and meshes by their convex hulls.
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
"""[N] below this no arrow is seen."""
LONGEST = 0.15
"""[m] length of the arrow of a strong force."""
STRONG = 95.0
"""Percentile of all forces of a run that counts as strong: a single impact must not make the rest invisible."""


@dataclass(frozen=True, slots=True)
class Push:
    """The normal force [N] between two parts at a point (3,) in the world; `direction` (3,), unit, is that of the force
    on the body that can move, or on the robot."""

    point: Array
    direction: Array
    force: float


class Forces:
    """The arrows of a playback; the parts are looked at when they are asked for."""

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
        strong = [one.force for each in self._contacts for one in each if one.force > LEAST]
        self.scale = LONGEST / float(np.percentile(strong, STRONG)) if strong else 0.0
        """[m/N] length of an arrow."""

    def at(self, k: int) -> tuple[Push, ...]:
        """What pushes at time number k."""
        found = (self._push(one, k) for one in self._contacts[k] if one.force > LEAST)
        return tuple(push for push in found if push is not None)

    def _push(self, contact: Contact, k: int) -> Push | None:
        X_WA, X_WB = (self._poses_of(name, k) for name in (contact.a, contact.b))
        found = [
            distance(one, X_WA @ X_AS, other, X_WB @ X_BS)
            for X_AS, one in self._of(contact.a)
            for X_BS, other in self._of(contact.b)
        ]
        if not found:
            return None
        nearest = min(found, key=lambda one: one.distance)
        point, normal = nearest.point, nearest.normal
        if not np.isfinite(nearest.distance) or not np.isfinite(normal).all():
            return None
        # The normal points from the first part to the second; a force on the first has the other sign.
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
    """The shapes that can be read; a mesh whose file is missing touches nothing that is drawn."""
    found = []
    for one in geometries:
        try:
            found.append((one.X_LS, coal_shape(one.shape)))
        except ValueError:
            continue
    return found
