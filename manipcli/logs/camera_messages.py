"""Decoders of the ROS 2 messages of cameras, with all their pixels and points; the bytes are untrusted."""

from __future__ import annotations

import numpy as np

from manipcli.logs.sensed_messages import COMPRESSED
from manipcli.record.cdr import CdrReader
from manipcli.render.lens import Lens
from manipcli.replay.pixels import MOST_PIXELS, PictureFile, Pixels, Unshown, picture_file, pixels
from manipcli.replay.rerun.measured import Cloud

CAMERA_INFO, POINTS = "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/PointCloud2"
_FLOAT32 = 7
"""Of PointField."""


def read_rows(reader: CdrReader, kind: str, *, labels: bool) -> tuple[str, Pixels | PictureFile]:
    """The frame and the picture of an Image or CompressedImage.

    Raises:
        CdrError: a message that is shorter than what it declares.
        Unshown: a picture that cannot be shown.
    """
    frame = reader.header().lstrip("/")
    if kind == COMPRESSED:
        form = reader.text()
        return frame, picture_file(form, reader.take(reader.count(1), 1))
    height, width, encoding = reader.u32(), reader.u32(), reader.text()
    big = bool(reader.take(1, 1)[0])
    step = reader.u32()
    data = reader.take(reader.count(1), 1)
    return frame, pixels(encoding, width, height, step, data, big=big, labels=labels)


def read_camera_info(reader: CdrReader) -> tuple[str, Lens]:
    """The frame and the lens of a CameraInfo; its distortion is left out.

    Raises:
        CdrError, Unshown: as for pictures.
    """
    frame = reader.header().lstrip("/")
    height, width = reader.u32(), reader.u32()
    reader.text()
    reader.skip(8 * reader.count(8), 8)
    k = np.frombuffer(reader.take(72, 8), "<f8").tolist()
    fx, cx, fy, cy = k[0], k[2], k[4], k[5]
    if not (0 < width * height <= MOST_PIXELS and np.isfinite(k).all() and fx > 0.0 and fy > 0.0):
        raise Unshown(f"{width} x {height} pixels with focal lengths {fx:g} and {fy:g}")
    return frame, Lens(width, height, fx, fy, cx, cy)


def read_cloud(reader: CdrReader) -> tuple[str, Cloud]:
    """The frame and the points of a PointCloud2 with x, y, z and, in 4 bytes `rgb` or `rgba`, colours.

    Raises:
        CdrError, Unshown: as for pictures.
    """
    frame = reader.header().lstrip("/")
    height, width = reader.u32(), reader.u32()
    fields: dict[str, tuple[int, int]] = {}
    for _ in range(reader.count(13)):
        name, offset, kind = reader.text(), reader.u32(), reader.take(1, 1)[0]
        reader.u32()
        fields[name] = offset, kind
    big = bool(reader.take(1, 1)[0])
    step, row = reader.u32(), reader.u32()
    data = reader.take(reader.count(1), 1)
    if not (
        0 < width * height <= MOST_PIXELS and row >= width * step and row * (height - 1) + width * step <= len(data)
    ):
        raise Unshown(f"{width} x {height} points in rows of {row} bytes do not fit {len(data)} bytes")
    if big or any(fields.get(axis, (0, 0))[1] != _FLOAT32 or fields[axis][0] + 4 > step for axis in "xyz"):
        raise Unshown("points without little-endian 32 bit x, y and z")

    def column(name: str, kind: str) -> np.ndarray:
        return np.ndarray((height, width), kind, data, fields[name][0], (row, step)).reshape(-1)

    points = np.stack([column(axis, "<f4") for axis in "xyz"], axis=1)
    with np.errstate(invalid="ignore"):  # signalling NaN
        known = np.isfinite(points).all(axis=1)
    colours = None
    packed = next((name for name in ("rgb", "rgba") if name in fields and fields[name][0] + 4 <= step), None)
    if packed is not None:
        word = column(packed, "<u4")[known]
        colours = np.stack([word >> 16 & 255, word >> 8 & 255, word & 255], axis=1).astype(np.uint8)
    return frame, Cloud(points[known], colours)
