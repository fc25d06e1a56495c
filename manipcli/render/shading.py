"""Light on surfaces, the same in pictures of cameras and of runs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array

TO_LIGHT = np.array([0.35, 0.55, 1.0]) / np.linalg.norm([0.35, 0.55, 1.0])
"""Unit vector towards the light in the world."""
AMBIENT, DIFFUSE = 0.62, 0.42
"""Brightness without and with the light."""


def shaded(colour: npt.NDArray[np.float32], shade: Array) -> npt.NDArray[np.uint8]:
    """Colours (..., 3) of 0 to 255 in the light, at these cosines (...) between the normal and the light."""
    bright = (AMBIENT + DIFFUSE * np.maximum(shade, 0.0)).astype(np.float32)
    found: npt.NDArray[np.uint8] = np.minimum(colour * bright[..., None], 255.0).astype(np.uint8)
    return found
