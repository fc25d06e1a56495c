"""Images: PNG files, written without any library, and the sky behind what is shown."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

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
    """The file of an image: 8 bits a channel, each row as its difference to the row above (PNG, ISO/IEC 15948)."""
    height, width, _ = image.shape
    rows = image.reshape(height, width * 3)
    above = np.vstack([np.zeros((1, width * 3), dtype=np.uint8), rows[:-1]])
    filtered = np.empty((height, 1 + width * 3), dtype=np.uint8)
    filtered[:, 0] = 2
    filtered[:, 1:] = rows - above  # modulo 256, as the standard wants it
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"".join(
        (
            b"\x89PNG\r\n\x1a\n",
            _chunk(b"IHDR", header),
            _chunk(b"IDAT", zlib.compress(filtered.tobytes(), 9)),
            _chunk(b"IEND", b""),
        )
    )


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def write_png(path: Path, image: Image) -> None:
    """Writes an image."""
    path.write_bytes(png_bytes(image))
