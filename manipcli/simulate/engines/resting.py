"""Bodies at rest, which an engine may let sleep: islands of touching bodies that have barely moved for a while.

A body of an island moves no other body outside it, so an island can sleep as a whole until something touches it.
Bodies that the robot or a thing with joints touches do not rest, however still they are.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np

from manipcli.model.state import WorldState
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Sphere

LOOK: Final = 0.05
"""[s] Between two looks at the bodies."""
LOOKS: Final = 4
"""Looks in a row at which a body has barely moved since the one before, until it rests."""
BARELY: Final = 2e-5
"""[m] Largest displacement of a body, and of its surface by rotation, between two looks: 0.4 mm/s."""
FIXED: Final = -1
"""In place of the row of a body: something that does not move and joins no bodies."""
AWAKE: Final = -2
"""In place of the row of a body: something that never rests."""


class Resting:
    """Watches the movable bodies of a scene.

    Args:
        scene: the bodies; those that joints move, and their roots, never rest.
        period: [s] of a tick.

    Attributes:
        jointed: names of the bodies of things with joints.
        never: rows of the movable ones among them.
        asleep: (m) whether each movable body is in an island that rests and has not moved since.
    """

    def __init__(self, scene: Scene, period: float) -> None:
        movable = scene.movable
        self.jointed = {name for joint in scene.joints for name in (joint.parent, joint.child)}
        self.never = {k for k, body in enumerate(movable) if body.name in self.jointed}
        self._radii = np.array([_radius(body) for body in movable])
        self._ticks, self._wait = 0, max(1, round(LOOK / period))
        self._position = np.full((len(movable), 3), np.inf)
        self._quat = np.zeros((len(movable), 4))
        self._still = np.zeros(len(movable), dtype=np.intp)
        self.asleep = np.zeros(len(movable), dtype=np.bool_)

    def due(self) -> bool:
        """Count a tick; whether a look is due."""
        self._ticks += 1
        return self._ticks % self._wait == 0

    def look(self, state: WorldState) -> bool:
        """Compare the bodies with the last look; whether any awake one is still for long enough to rest."""
        position, quat = state.body_position, state.body_quat_xyzw
        shift = np.abs(position - self._position).max(axis=1)
        turn = 2.0 * np.minimum(np.abs(quat - self._quat).max(axis=1), np.abs(quat + self._quat).max(axis=1))
        still = (shift <= BARELY) & (turn * self._radii <= BARELY)
        self._still[:] = np.where(still, self._still + 1, 0)
        self.asleep &= (position == self._position).all(axis=1) & (quat == self._quat).all(axis=1)
        self._position[:], self._quat[:] = position, quat
        return bool(((self._still >= LOOKS) & ~self.asleep).any())

    def islands(self, touching: Iterable[tuple[int, int]]) -> list[int]:
        """The rows of awake bodies in islands that rest now; they count as asleep from now on.

        Args:
            touching: pairs of rows in contact, each possibly `FIXED` or `AWAKE`.
        """
        m = len(self.asleep)
        island = list(range(m + 1))  # the last one is that of all that never rests

        def root(k: int) -> int:
            while island[k] != k:
                island[k] = island[island[k]]
                k = island[k]
            return k

        for a, b in touching:
            if a != FIXED and b != FIXED:
                island[root(m if a == AWAKE else a)] = root(m if b == AWAKE else b)
        restless = {root(m), *(root(k) for k in range(m) if self._still[k] < LOOKS or k in self.never)}
        found = [k for k in range(m) if root(k) not in restless and not self.asleep[k]]
        self.asleep[found] = True
        return found

    def wake(self) -> None:
        """Let all bodies rest only after another while."""
        self.asleep[:] = False
        self._still[:] = 0


def _radius(body: Body) -> float:
    """[m] of the surface of a body about its centre of mass; 0 for a sphere, which any rotation leaves in place."""
    shapes = [geometry.shape for geometry in body.geometries]
    centred = all(np.allclose(geometry.X_LS.p, body.X_OI.p) for geometry in body.geometries)
    if centred and all(isinstance(shape, Sphere) for shape in shapes):
        return 0.0
    return float(np.linalg.norm(body.size))
