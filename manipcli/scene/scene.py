"""The scene around the robot: bodies and named frames, immutable.

The frame O of a body is at its reference point: the centre of a box or sphere; the centre of the *bottom* of a cup,
tray or cylinder, z up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.scene.joints import SceneJoint
from manipcli.scene.known import Known
from manipcli.scene.walls import Walls
from manipcli.shapes.primitives import Box, Cylinder, Geometry

SEPARATOR: Final = "/"
"""Between a body and its part: `cup/handle`."""
FACES: Final = {"top": 1.0, "bottom": -1.0}
"""Parts that every body has: the middles of the upper and the lower face of its bounding box."""
RIM: Final = "rim"
"""Part of a container: the middle of its opening."""


@dataclass(frozen=True, slots=True)
class Interior:
    """The hollow of a container: a box or an upright cylinder, open at its top (+z of O).

    Attributes:
        X_OS: of its middle; its rim is half of its depth above.
        shape: all of it, or with `walls` a part that reaches down from the rim.
        walls: of a hollow of another shape.
    """

    X_OS: Transform
    shape: Box | Cylinder
    walls: Walls | None = None

    @property
    def rim(self) -> float:
        """[m] Height of its rim in S."""
        return (self.shape.length if isinstance(self.shape, Cylinder) else self.shape.size[2]) / 2.0

    @property
    def floor(self) -> float:
        """[m] Height of its floor in S, on its axis."""
        return -self.rim if self.walls is None else self.walls.levels[0]

    def contains(self, point: Array) -> bool:
        """Whether a point (3,) [m] in S is inside."""
        if self.walls is not None:
            return bool(self.floor < point[2] < self.rim and self.walls.room(point) > 0.0)
        x, y, z = (float(v) for v in point)
        if isinstance(self.shape, Cylinder):
            return math.hypot(x, y) < self.shape.radius and abs(z) < self.shape.length / 2
        return all(abs(v) < size / 2 for v, size in zip((x, y, z), self.shape.size, strict=True))


@dataclass(frozen=True, slots=True)
class Body:
    """A body in the scene.

    Attributes:
        name: as in the task.
        kind: its shape word in the task file (`box`, `cup`, ...).
        geometries: shapes in O, for contact and for drawing.
        mass: [kg]; 0 when fixed.
        X_OI: inertial frame in O (origin at the centre of mass).
        inertia: (3, 3) [kg m2] in I.
        friction, rolling_friction, spinning_friction: coefficients of this body; the engine combines two bodies'.
        restitution: 0 to 1.
        fixed: never moves.
        X_WO: its pose at the start.
        interior: the hollow of a container, else None.
        size: (3,) [m] bounding box of the body in O (full lengths).
        centre: (3,) [m] centre of that bounding box in O.
        known: of a believed scene, how well the robot knows X_WO; None: exactly.
    """

    name: str
    kind: str
    geometries: tuple[Geometry, ...]
    mass: float
    X_OI: Transform
    inertia: Array
    friction: float
    rolling_friction: float
    spinning_friction: float
    restitution: float
    fixed: bool
    X_WO: Transform
    interior: Interior | None
    size: Array
    centre: Array
    known: Known | None = None


@dataclass(frozen=True, slots=True)
class Frame:
    """A named frame, fixed in `parent`: 'world' or a body. A part of a body is a frame named `cup/handle`.

    Attributes:
        name, parent: as in the task.
        X_PF: its pose in the parent.
        size: (3,) [m] of a part, about its frame; None: it is a point.
    """

    name: str
    parent: str
    X_PF: Transform
    size: Array | None = None


@dataclass(frozen=True)
class Scene:
    """Bodies, named frames and gravity (3,) [m/s2] in the world; the bodies that joints move are last.

    `joints`: parents before children, in the order of the bodies that they move. These are movable also where the root
    is fixed.
    """

    bodies: tuple[Body, ...]
    frames: tuple[Frame, ...]
    gravity: Array
    joints: tuple[SceneJoint, ...] = ()

    @cached_property
    def movable(self) -> tuple[Body, ...]:
        """The bodies that can move, in the order of all body arrays (m, ...) of a `WorldState`."""
        return tuple(body for body in self.bodies if not body.fixed)

    @cached_property
    def _bodies(self) -> dict[str, Body]:
        return {body.name: body for body in self.bodies}

    @cached_property
    def _frames(self) -> dict[str, Frame]:
        return {frame.name: frame for frame in self.frames}

    def body(self, name: str) -> Body:
        return self._bodies[name]

    def mover(self, body: str) -> tuple[int, SceneJoint]:
        """The number of the joint that moves a body, and the joint."""
        return next((k, joint) for k, joint in enumerate(self.joints) if joint.child == body)

    def frame(self, name: str) -> Frame | None:
        """The frame of this name: a named frame, a part of a body, or a part that the body has by its shape."""
        if name in self._frames:
            return self._frames[name]
        owner, _, part = name.rpartition(SEPARATOR)
        root, link, _ = owner.partition(SEPARATOR)
        if link and (own := self._frames.get(f"{root}{SEPARATOR}{part}")) is not None and own.parent == owner:
            return replace(own, name=name)
        body = self._bodies.get(owner)
        X_OP = None if body is None else ready_part(part, body.size, body.centre, body.interior)
        return None if X_OP is None else Frame(name, owner, X_OP)

    def parts(self, body: str) -> tuple[str, ...]:
        """The names of a body's parts, without that of the body: those of the task first.

        A part on a link of a jointed thing is one of the link and of the whole.
        """
        names = ((each.parent, *each.name.rpartition(SEPARATOR)) for each in self.frames)
        own = [part for parent, owner, _, part in names if owner and body in (owner, parent)]
        rim = () if self.body(body).interior is None else (RIM,)
        return tuple(dict.fromkeys((*own, *FACES, *rim)))


def ready_part(part: str, size: Array, centre: Array, interior: Interior | None) -> Transform | None:
    """X_OP of a part that a body has by its shape, with the axes of the body's frame; None: it has no such part.

    Args:
        part: `top`, `bottom`, or `rim` of a container.
        size, centre: (3,) [m] of the bounding box in O.
        interior: the hollow.
    """
    side = FACES.get(part, 1.0 if part == RIM and interior is not None else 0.0)
    if side == 0.0:
        return None
    p = np.array([centre[0], centre[1], centre[2] + side * size[2] / 2.0])
    if part == RIM and interior is not None:
        opening = interior.X_OS.apply([0.0, 0.0, interior.rim])
        p = opening if np.linalg.norm(opening - p) > 1e-6 else p
    return Transform.of(xyz=p)
