"""What sensors of a log measured, sampled for display: pictures, forces on taxels, distances along rays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, Transform

PictureKind = Literal["colour", "depth", "labels"]
Counts = npt.NDArray[np.uint16]

UNKNOWN = 65535
"""Count of a value that was not measured."""
MOST_COUNT = 65000
"""Largest count of a measured value."""


@dataclass(frozen=True, slots=True)
class PictureStream:
    """The pictures of one topic.

    Attributes:
        name: of the topic within its camera, `image_raw`.
        kind: colours, depth in levels between `low` and `high` (transparent: not measured), or numbers of parts.
        size: width and height as shown [pixel].
        times: (T,) arrivals [s].
        pictures: (T,) files, WebP or PNG.
        low, high: (T,) depths of the levels 0 and 255 [m]; NaN unless `kind` is depth.
        note: how they differ from the log; "" if all are shown as they are.
    """

    name: str
    kind: PictureKind
    size: tuple[int, int]
    times: Array
    pictures: tuple[bytes, ...]
    low: Array
    high: Array
    note: str = ""


@dataclass(frozen=True, slots=True)
class CameraFeed:
    """The topics of one camera."""

    name: str
    streams: tuple[PictureStream, ...]


@dataclass(frozen=True, slots=True)
class TaxelFeed:
    """A grid of taxels.

    Attributes:
        name: of the sensor.
        rows, columns: cells along y and x.
        cell: lengths of a cell along x and y [m].
        times: (T,) arrivals [s].
        counts: (T, rows * columns) forces in units of `unit`.
        unit: [N].
        note: as for pictures.
    """

    name: str
    rows: int
    columns: int
    cell: tuple[float, float]
    times: Array
    counts: Counts
    unit: float
    note: str = ""


@dataclass(frozen=True, slots=True)
class RayFeed:
    """A range finder.

    Attributes:
        name: of the sensor.
        parent: frame of the drawing that it is fixed in.
        X_PS: pose of its frame in `parent`; rays are in the plane z = 0.
        angles: (rays) from x towards y [rad].
        times, taken: (T,) arrivals and measurements [s].
        counts: (T, rays) distances in units of `unit`.
        unit: [m].
        note: as for pictures.
    """

    name: str
    parent: str
    X_PS: Transform
    angles: Array
    times: Array
    taken: Array
    counts: Counts
    unit: float
    note: str = ""


@dataclass(frozen=True, slots=True)
class Sensed:
    """All that is shown; `notes`: what is not, one sentence each."""

    cameras: tuple[CameraFeed, ...] = ()
    taxels: tuple[TaxelFeed, ...] = ()
    rays: tuple[RayFeed, ...] = ()
    notes: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.cameras or self.taxels or self.rays or self.notes)


def counted(values: Array) -> tuple[Counts, float]:
    """Values as counts, and their unit; negative values are 0, those that are not finite are unknown."""
    known = np.isfinite(values)
    most = float(values[known].max(initial=0.0))
    unit = most / MOST_COUNT or 1.0  # of denormal numbers, too
    counts = np.clip(np.rint(np.where(known, values, 0.0) / unit), 0, MOST_COUNT)
    return np.where(known, counts, UNKNOWN).astype(np.uint16), unit
