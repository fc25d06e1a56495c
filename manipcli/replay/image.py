"""Images: their PNG files, and the sky behind what is shown."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
"""(height, width, 3) red, green, blue; row 0 is the top."""

SKY = ((203, 213, 224), (246, 248, 250))
"""Behind everything, from top to bottom."""


def sky(height: int) -> Image:
    """(height, 1, 3) the background of every picture and view."""
    part = np.linspace(0.0, 1.0, height)[:, None, None]
    image: Image = ((1.0 - part) * np.array(SKY[0]) + part * np.array(SKY[1])).round().astype(np.uint8)
    return image


def png_bytes(image: Image) -> bytes:
    """The PNG file of an image."""
    from PIL import Image as PillowImage

    stream = BytesIO()
    PillowImage.fromarray(image).save(stream, "PNG", compress_level=9)
    return stream.getvalue()
