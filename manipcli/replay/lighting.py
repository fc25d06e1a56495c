"""Light of pictures of runs: unlike a camera's, it shades what looks away from the light, and no colour saturates.

The cameras of a simulation have one brightness for everything in the shade (`render.shading`), in which a white arm has
no form; what they see is in the log, so it stays.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array

AROUND, DIRECT = 0.36, 0.28
"""Brightness from around, the more the more a surface looks to the light, and directly from the light."""
LEAST = 0.34
"""Brightness of what looks away from the light."""
STRENGTH = 0.8
"""Share of the direct light, and of half of that from around, that a shadow takes."""


def brightness(cosine: Array) -> Array:
    """0 to 1, at these cosines between the normal and the light."""
    found: Array = LEAST + AROUND * 0.5 * (1.0 + cosine) + DIRECT * np.maximum(cosine, 0.0)
    return found


def shadow_loss(cosine: Array) -> Array:
    """The share of its brightness that a surface loses in the shadow, at these cosines."""
    facing = np.maximum(cosine, 0.0)
    found: Array = STRENGTH * (DIRECT + 0.25 * AROUND) * facing / brightness(cosine)
    return found


def lit(colour: npt.NDArray[np.float32], cosine: Array) -> npt.NDArray[np.uint8]:
    """Colours (..., 3) of 0 to 255 in the light, at these cosines (...)."""
    bright = brightness(cosine).astype(np.float32)
    found: npt.NDArray[np.uint8] = np.clip(colour * bright[..., None], 0.0, 255.0).astype(np.uint8)
    return found
