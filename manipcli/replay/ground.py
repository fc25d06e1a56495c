"""The ground of pictures: a plane with a grid of 0.1 m and 1 m that fades into the sky."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.render.drawing import Drawing, floors_of, ground_height
from manipcli.render.placing import Poses
from manipcli.render.shading import TO_LIGHT
from manipcli.replay.camera import Camera
from manipcli.replay.lighting import brightness
from manipcli.scene.scene import Scene

COLOUR = (205.0, 209.0, 215.0)
"""Unlit, darker than the lit side of a white robot."""
GRID = ((0.1, 0.0012, 0.16), (1.0, 0.003, 0.30))
"""Spacing [m], width [m] and darkness of the lines."""
FADED = 7.0
"""Distance at which the ground has mostly faded, by the distance of the camera to its target."""


@dataclass(frozen=True, slots=True)
class SeenGround:
    """The ground in a picture: (h, w) `depth` along the optical axis [m], infinite where it is not, and (h, w, 3)
    `colour` 0 to 255 with (h, w) `share` of it in the background."""

    depth: Array
    colour: npt.NDArray[np.float32]
    share: npt.NDArray[np.float32]


def ground_of(drawing: Drawing, poses: Poses, scene: Scene | None) -> float:
    """Height [m] of the ground of a run, with the `poses` of its first state."""
    return ground_height(drawing, poses, floors_of(scene))


def see_ground(height: float, camera: Camera, size: tuple[int, int]) -> SeenGround | None:
    """The ground at `height` [m] in a picture of this width and height; None from below, or if it is not in view."""
    X_WC, lens = camera.X_WC, camera.lens(size)
    above = float(X_WC.p[2]) - height
    if above <= 0.0:
        return None
    columns, rows = lens.columns[None, :], lens.rows[:, None]
    # The ray through each pixel, with 1 along the optical axis.
    x, y, z = (X_WC.R[k, 0] * columns + X_WC.R[k, 1] * rows + X_WC.R[k, 2] for k in range(3))
    down = z < -1e-9
    if not down.any():
        return None
    with np.errstate(divide="ignore"):
        depth = np.where(down, -above / np.where(down, z, -1.0), np.inf)
    finite = np.where(down, depth, 0.0)
    points = X_WC.p[0] + finite * x, X_WC.p[1] + finite * y
    away = finite * np.sqrt(x * x + y * y + z * z)
    dark = np.zeros(depth.shape)
    for spacing, width, strength in GRID:
        for axis in points:
            dark = np.maximum(dark, strength * _lines(axis, spacing, width))
    lit = np.array(COLOUR) * float(brightness(np.array(TO_LIGHT[2])))
    colour = (lit * (1.0 - dark)[..., None]).astype(np.float32)
    share = np.where(down, np.exp(-((away / (FADED * camera.distance)) ** 2) * 2.0), 0.0)
    return SeenGround(depth, colour, share.astype(np.float32))


def _lines(along: Array, spacing: float, width: float) -> Array:
    """(h, w) coverage of pixels by lines at multiples of `spacing` [m]; `along` (h, w): coordinate of the pixels."""
    footprint = np.maximum(np.abs(np.gradient(along, axis=0)) + np.abs(np.gradient(along, axis=1)), 1e-9)
    apart = np.abs(along - spacing * np.round(along / spacing))
    drawn = np.maximum(width, footprint)  # thinner than a pixel: a pixel wide and paler
    covered = np.clip(0.5 + (0.5 * drawn - apart) / footprint, 0.0, 1.0) * width / drawn
    # Lines nearer to each other than pixels would make patterns.
    found: Array = covered * np.clip(2.0 - 4.0 * footprint / spacing, 0.0, 1.0)
    return found
