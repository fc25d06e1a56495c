"""Decoders of the ROS 2 messages of sensors that are shown; the bytes are untrusted."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array
from manipcli.record.cdr import NS_PER_S, CdrReader
from manipcli.replay.pixels import Small, Unshown, from_compressed, from_image

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
TAXELS = "manipcli_msgs/msg/Taxels"
SCAN, RANGE = "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/Range"
SEGMENTATION = "/segmentation"

MOST_CELLS = 1 << 14
MOST_RAYS = 720
"""Of a scan; of more, every second, third, ... is shown."""
FARTHEST, STRONGEST = 1e4, 1e6
"""Largest shown distance [m] and force [N]."""


@dataclass(frozen=True, slots=True)
class Grid:
    """A message of taxels: cells along y and x, their lengths [m], and (rows * columns) forces [N]."""

    rows: int
    columns: int
    cell: tuple[float, float]
    force: Array


@dataclass(frozen=True, slots=True)
class Sweep:
    """A message of a range finder: its frame, its stamp [ns], and (rays) angles [rad] and distances [m]."""

    frame: str
    stamp: int
    angles: Array
    distance: Array


def read_picture(reader: CdrReader, topic: str, kind: str) -> Small:
    """The picture of an Image or CompressedImage.

    Raises:
        CdrError: a message that is shorter than what it declares.
        Unshown: a picture that cannot be shown.
    """
    reader.header()
    if kind == COMPRESSED:
        form = reader.text()
        return from_compressed(form, reader.take(reader.count(1), 1))
    height, width, encoding = reader.u32(), reader.u32(), reader.text()
    big = bool(reader.take(1, 1)[0])
    step = reader.u32()
    data = reader.take(reader.count(1), 1)
    return from_image(encoding, width, height, step, data, big=big, labels=topic.endswith(SEGMENTATION))


def read_grid(reader: CdrReader) -> Grid:
    """The cells of a Taxels.

    Raises:
        CdrError, Unshown: as for pictures.
    """
    reader.header()
    rows, columns, width, height = reader.u32(), reader.u32(), reader.f64(), reader.f64()
    count = reader.count(8)
    if not (0 < rows * columns <= MOST_CELLS and count == rows * columns):
        raise Unshown(f"{rows} x {columns} cells do not fit {count} forces, or are more than {MOST_CELLS}")
    if not (0.0 < width < 1e3 and 0.0 < height < 1e3):
        raise Unshown(f"cells of {width:g} m x {height:g} m")
    force = np.frombuffer(reader.take(8 * count, 8), "<f8")
    return Grid(rows, columns, (width, height), np.where(np.abs(force) <= STRONGEST, force, np.nan))


def read_sweep(reader: CdrReader, kind: str) -> Sweep:
    """The rays of a LaserScan or Range.

    Raises:
        CdrError, Unshown: as for pictures.
    """
    second, nanosecond = struct.unpack("<iI", reader.take(8, 4))
    frame = reader.text().lstrip("/")
    stamp = second * NS_PER_S + nanosecond
    if kind == RANGE:
        reader.skip(1, 1)
        _, least, most, distance = _floats(reader, 4)
        return Sweep(frame, stamp, np.zeros(1), _measured(np.array([distance]), least, most))
    first, _, step, _, _, least, most = _floats(reader, 7)
    count = reader.count(4)
    if not (np.isfinite([first, step]).all() and abs(step) * count < 100.0):
        raise Unshown(f"{count} rays from {first:g} rad in steps of {step:g} rad")
    every = max(1, -(-count // MOST_RAYS))
    with np.errstate(invalid="ignore"):  # signalling NaN
        distances = np.frombuffer(reader.take(4 * count, 4), "<f4").astype(np.float64)[::every]
    return Sweep(
        frame, stamp, first + step * np.arange(count, dtype=np.float64)[::every], _measured(distances, least, most)
    )


def _measured(distances: Array, least: float, most: float) -> Array:
    """The distances in the range of the sensor; others are infinite."""
    within = (distances >= least) & (distances <= min(most, FARTHEST))
    return np.where(within, distances, np.inf)


def _floats(reader: CdrReader, count: int) -> tuple[float, ...]:
    return struct.unpack(f"<{count}f", reader.take(4 * count, 4))
