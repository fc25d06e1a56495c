"""Pictures of a robot and a scene by a pinhole camera: depth, parts and shaded colours, the same with every engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, Transform
from manipcli.model.state import WorldState
from manipcli.render.lens import Lens
from manipcli.render.raster import Fragments, Raster
from manipcli.render.shading import TO_LIGHT, shaded
from manipcli.render.stage import Stage

SKY = (225, 231, 237)
"""Colour where nothing is."""

X_SC = Transform.of(rpy=(-np.pi / 2.0, 0.0, -np.pi / 2.0))
"""Optical frame C (z forward, x right, y down) in the frame of the sensor S (x forward, y left, z up), REP 103."""


@dataclass(frozen=True, slots=True)
class View:
    """Where everything was when a picture was taken: `rotation` (s, 3, 3) and `position` (s, 3) [m] of the surfaces in
    the optical frame, and `light` (3,) towards the light."""

    rotation: Array
    position: Array
    light: Array


@dataclass(frozen=True, slots=True)
class Shot:
    """A picture without noise.

    Attributes:
        depth: (h, w) along z of the optical frame [m]; infinite where nothing is.
        cosine: (h, w) between the ray and the normal of the surface; 0 where nothing is.
        part: (h, w) uint16 index into `Stage.parts`; 0 where nothing is.
        colour: (h, w, 3) uint8; None if it was not asked for.
    """

    depth: Array
    cosine: Array
    part: npt.NDArray[np.uint16]
    colour: npt.NDArray[np.uint8] | None


class SceneCamera:
    """A camera for a stage; what is nearer than `near` [m] is not seen."""

    def __init__(self, stage: Stage, lens: Lens, near: float = 1e-3) -> None:
        self.stage = stage
        self.lens = lens
        self._raster = Raster(stage.surfaces, lens, near)
        counts = np.diff(self._raster.first_face)
        # The last entry is that of index -1, where nothing is.
        self._part = np.append(np.repeat(stage.part_of, counts), 0).astype(np.uint16)
        self._colour = np.append(np.repeat(stage.colours, counts, axis=0), [np.divide(SKY, 255.0)], axis=0)
        self._colour = (255.0 * self._colour).astype(np.float32)
        self._length = np.sqrt(1.0 + lens.columns**2 + lens.rows[:, None] ** 2)

    def view(self, state: WorldState, X_WC: Transform) -> View:
        """What a picture needs of a state; the camera is at X_WC, in the optical convention."""
        return View(*self.stage.poses(state, X_WC), X_WC.R.T @ TO_LIGHT)

    def shoot(self, view: View, *, colour: bool = True) -> Shot:
        """The picture of a view; new arrays."""
        seen = self._raster.see(view.rotation, view.position, view.light)
        return Shot(
            depth=seen.depth.copy(),
            cosine=seen.slope / self._length,
            part=self._part[seen.face],
            colour=self._coloured(seen) if colour else None,
        )

    def _coloured(self, seen: Fragments) -> npt.NDArray[np.uint8]:
        found = shaded(self._colour[seen.face], seen.shade)
        found[seen.face < 0] = SKY
        return found
