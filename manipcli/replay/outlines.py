"""Outlines of pictures: where the depth jumps, the nearer part is darker, so that white is seen before white.

The inverse depth of a plane is linear in the picture. Its second difference is thus zero on planes, even at a grazing
angle, small at their edges, and large where something is in front of something else.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array

REACH = 3
"""Width of an outline [pixel of the finer picture]."""
LOW, HIGH = 0.004, 0.02
"""Jump of the inverse depth, as a share of it, at which an outline begins and is complete."""
DARKNESS = 0.5
"""Share of the light that an outline takes."""


def outline_light(depth: Array) -> npt.NDArray[np.float32]:
    """(h, w) factor of the brightness, for the depth (h, w) [m] of a picture, infinite where nothing is."""
    inverse = (1.0 / depth).astype(np.float32)
    jump = np.zeros_like(inverse)
    for line, found in ((inverse, jump), (inverse.T, jump.T)):
        nearer = 2.0 * line[REACH:-REACH] - line[: -2 * REACH] - line[2 * REACH :]
        np.maximum(found[REACH:-REACH], nearer, out=found[REACH:-REACH])
    share = jump / np.maximum(inverse, 1e-12)
    light = 1.0 - DARKNESS * np.clip((share - LOW) / (HIGH - LOW), 0.0, 1.0)
    return light.astype(np.float32, copy=False)
