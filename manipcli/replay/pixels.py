"""Pictures of any ROS 2 log, small enough for a page: from the bytes of Image and CompressedImage to WebP and PNG.

The bytes are untrusted: every size is checked against the data before it is used.
"""

from __future__ import annotations

import struct
import warnings
import zlib
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.text import shorten
from manipcli.replay.sensed import PictureKind

if TYPE_CHECKING:
    from PIL.Image import Image as PillowImage

MOST_SIDE = 480
"""Longest side of a picture on a page [pixel]; larger ones are reduced by a whole factor."""
MOST_PIXELS = 1 << 25
"""Of a picture in a log."""
QUALITY = 60
"""Of WebP, 0 to 100."""
SPREAD = (0.5, 99.5)
"""Percentiles of the depths that get the lowest and the highest level."""
_COLOURS = {
    "rgb8": (3, (0, 1, 2)), "bgr8": (3, (2, 1, 0)), "rgba8": (4, (0, 1, 2)), "bgra8": (4, (2, 1, 0)),
    "8UC3": (3, (2, 1, 0)), "8UC4": (4, (2, 1, 0)), "mono8": (1, (0, 0, 0)), "8UC1": (1, (0, 0, 0)),
}  # fmt: skip
"""Bytes of a pixel, and which of them are red, green and blue."""
_DEPTHS = {"16UC1": 1e-3, "32FC1": 1.0}
"""Their unit [m] (REP 118)."""
_WIDE = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}
"""Types of pixels of more than a byte."""
_DEPTH_HEAD = 12
"""Bytes before the PNG of `compressedDepth`."""


class Unshown(ValueError):
    """A picture that cannot be shown, with the reason."""


@dataclass(frozen=True, slots=True)
class Pixels:
    """A picture as it is: `rows` (h, w, 3) of colours, 0 to 255, else (h, w); `unit` of depths [m]."""

    kind: PictureKind
    rows: npt.NDArray[np.generic]
    unit: float = 1.0


@dataclass(frozen=True, slots=True)
class PictureFile:
    """A compressed picture as it is in the log, with checked dimensions; `kind` is depth for PNG with millimetres."""

    kind: Literal["colour", "depth"]
    media_type: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Small:
    """A picture for a page: its file, size [pixel] and kind; `low` and `high` as in `PictureStream`."""

    data: bytes
    size: tuple[int, int]
    kind: PictureKind
    low: float = np.nan
    high: float = np.nan


def pixels(
    encoding: str, width: int, height: int, step: int, data: memoryview, *, big: bool = False, labels: bool = False
) -> Pixels:
    """The pixels of a sensor_msgs/Image.

    Args:
        encoding: of its pixels, `rgb8`.
        width, height: [pixel].
        step: bytes of a row.
        data: the rows.
        big: numbers are big-endian.
        labels: the pixels are numbers of parts.

    Raises:
        Unshown: an unknown encoding, or sizes that do not fit the data.
    """
    channels, order = _COLOURS.get(encoding, (1, (0, 0, 0)))
    if encoding not in _COLOURS and encoding not in _WIDE:
        raise Unshown(f"encoding '{shorten(encoding)}' is not shown")
    kind = np.dtype(_WIDE.get(encoding, "u1")).newbyteorder(">" if big else "<")
    pixel = channels * kind.itemsize
    if not (width > 0 and height > 0 and width * height <= MOST_PIXELS):
        raise Unshown(f"{width} x {height} pixels are not between 1 and {MOST_PIXELS}")
    needed = step * (height - 1) + width * pixel
    if step < width * pixel or needed > len(data):
        raise Unshown(f"{width} x {height} {encoding} in rows of {step} bytes do not fit {len(data)} bytes")
    rows: npt.NDArray[np.generic] = np.ndarray(
        (height, width, channels), kind, buffer=data, strides=(step, pixel, kind.itemsize)
    )
    if labels and encoding in ("8UC1", "16UC1", "mono8", "mono16"):
        return Pixels("labels", rows[..., 0])
    if encoding in _DEPTHS:
        return Pixels("depth", rows[..., 0], _DEPTHS[encoding])
    if encoding == "mono16":
        return Pixels("colour", np.repeat(_bright(rows[..., :1]), 3, axis=2))
    return Pixels("colour", np.ascontiguousarray(rows[..., list(order)]).astype(np.uint8))


def from_image(
    encoding: str, width: int, height: int, step: int, data: memoryview, *, big: bool = False, labels: bool = False
) -> Small:
    """The picture of a sensor_msgs/Image; arguments and errors are those of `pixels`."""
    found = pixels(encoding, width, height, step, data, big=big, labels=labels)
    if found.kind == "labels":
        return _labels(found.rows)
    if found.kind == "depth":
        return _depth(found.rows, found.unit)
    from PIL import Image

    return _colour(Image.fromarray(np.ascontiguousarray(found.rows[..., 0] if encoding == "mono16" else found.rows)))


def from_compressed(form: str, data: memoryview) -> Small:
    """The picture of a sensor_msgs/CompressedImage: JPEG, PNG, WebP, or `compressedDepth` with PNG.

    Raises:
        Unshown: another format, damaged data or too many pixels.
    """
    from PIL import Image

    deep = "compressedDepth" in form
    if deep and "32FC1" in form:
        raise Unshown("compressedDepth of 32FC1 is not shown")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the size is checked below
            image = Image.open(BytesIO(data[_DEPTH_HEAD:] if deep else data), formats=("JPEG", "PNG", "WEBP"))
            if image.width * image.height > MOST_PIXELS:
                raise Unshown(f"{image.width} x {image.height} pixels are more than {MOST_PIXELS}")
            image.draft("RGB", (MOST_SIDE, MOST_SIDE))
            image.load()
            if image.mode in ("I;16", "I"):
                numbers = np.asarray(image)
                return (
                    _depth(numbers, _DEPTHS["16UC1"])
                    if deep or "16UC1" in form
                    else _colour(Image.fromarray(_bright(numbers)))
                )
            return _colour(image.convert("RGB"))
    except Unshown:
        raise
    except (OSError, SyntaxError, ValueError, EOFError, OverflowError, struct.error, zlib.error) as error:
        raise Unshown(f"a damaged picture of format '{shorten(form)}'") from error
    except Image.DecompressionBombError as error:
        raise Unshown(f"more than {MOST_PIXELS} pixels") from error


def picture_file(form: str, data: memoryview) -> PictureFile:
    """The file in a sensor_msgs/CompressedImage, JPEG or PNG, if its head is sound and its size can be decoded.

    Raises:
        Unshown: another format, a damaged head or too many pixels.
    """
    from PIL import Image

    deep = "compressedDepth" in form
    if deep and "32FC1" in form:
        raise Unshown("compressedDepth of 32FC1 is not shown")
    content = bytes(data[_DEPTH_HEAD:] if deep else data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the size is checked below
            image = Image.open(BytesIO(content), formats=("PNG",) if deep else ("JPEG", "PNG"))
    except (OSError, SyntaxError, ValueError, EOFError, OverflowError, struct.error, zlib.error) as error:
        raise Unshown(f"a damaged picture of format '{shorten(form)}'") from error
    except Image.DecompressionBombError as error:
        raise Unshown(f"more than {MOST_PIXELS} pixels") from error
    if image.width * image.height > MOST_PIXELS:
        raise Unshown(f"{image.width} x {image.height} pixels are more than {MOST_PIXELS}")
    return PictureFile("depth" if deep else "colour", f"image/{(image.format or '').lower()}", content)


def _bright(rows: npt.NDArray[np.generic]) -> npt.NDArray[np.uint8]:
    """Numbers as brightness; the largest are white."""
    bright = rows.astype(np.float32)
    most = max(float(np.percentile(bright, SPREAD[1])), 1.0)
    scaled: npt.NDArray[np.uint8] = np.clip(bright * (255.0 / most), 0.0, 255.0).astype(np.uint8)
    return scaled


def _factor(width: int, height: int) -> int:
    return -(-max(width, height) // MOST_SIDE)


def _colour(image: PillowImage) -> Small:
    small = image.reduce(_factor(*image.size))
    return Small(_webp(small), small.size, "colour")


def _depth(rows: npt.NDArray[np.generic], unit: float) -> Small:
    """Levels 0 to 255 from the lowest to the highest depth; what was not measured is transparent."""
    from PIL import Image

    factor = _factor(rows.shape[1], rows.shape[0])
    with np.errstate(invalid="ignore", over="ignore"):  # signalling NaN
        metres = rows[::factor, ::factor].astype(np.float32) * np.float32(unit)
    known = np.isfinite(metres) & (metres > 0.0)
    low, high = (float(np.percentile(metres[known], part)) for part in SPREAD) if known.any() else (0.0, 0.0)
    spread = max(high - low, 1e-6)
    levels = np.rint(255.0 * np.clip((np.where(known, metres, low) - low) / spread, 0.0, 1.0))
    image = Image.fromarray(np.dstack([*[levels] * 3, np.where(known, 255, 0)]).astype(np.uint8))
    return Small(_webp(image), image.size, "depth", low, low + spread)


def _labels(rows: npt.NDArray[np.generic]) -> Small:
    """A PNG in which each number has a colour; 0 is white."""
    from PIL import Image

    factor = _factor(rows.shape[1], rows.shape[0])
    image = Image.fromarray((rows[::factor, ::factor].astype(np.int64) % 256).astype(np.uint8))
    number = np.arange(256)
    palette = np.stack([64 + number * step % 160 for step in (97, 59, 151)], axis=1)
    palette[0] = 255
    image.putpalette(palette.astype(np.uint8).tobytes())
    stream = BytesIO()
    image.save(stream, "PNG", optimize=True)
    return Small(stream.getvalue(), image.size, "labels")


def _webp(image: PillowImage) -> bytes:
    stream = BytesIO()
    image.save(stream, "WEBP", quality=QUALITY, method=2)
    return stream.getvalue()
