"""What sensors measured, as it is logged for Rerun."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, Transform
from manipcli.render.lens import Lens
from manipcli.replay.pixels import PictureFile, Pixels
from manipcli.replay.playback import PlotTable
from manipcli.replay.sensed import RayFeed, TaxelFeed


@dataclass(frozen=True, slots=True)
class Mount:
    """Where a sensor is: the pose of its frame in `parent`, a frame of the drawing."""

    parent: str
    X_PS: Transform


@dataclass(frozen=True, slots=True)
class Cloud:
    """Points (p, 3) [m] in the frame of the sensor, and their colours (p, 3), if they have any."""

    points: npt.NDArray[np.float32]
    colours: npt.NDArray[np.uint8] | None


@dataclass(frozen=True, slots=True)
class Measurement:
    """A message of a camera.

    Attributes:
        camera, stream: the name of its topic in two parts: `kinect`, `depth`.
        time: arrival [s].
        mount: None if its frame is not in the drawing.
        lens: None without CameraInfo.
        content: what was measured.
    """

    camera: str
    stream: str
    time: float
    mount: Mount | None
    lens: Lens | None
    content: Pixels | PictureFile | Cloud


@dataclass(frozen=True, slots=True)
class Measured:
    """All that sensors of a log measured.

    Attributes:
        pictures: messages of cameras in the order of the file, read while they are logged.
        taxels, rays: grids of taxels and range finders.
        numbers: forces, accelerations and switches, one table for each quantity: `wrist force`.
    """

    pictures: Iterator[Measurement]
    taxels: tuple[TaxelFeed, ...] = ()
    rays: tuple[RayFeed, ...] = ()
    numbers: tuple[PlotTable, ...] = ()


def distances(feed: RayFeed, unknown: int) -> Array:
    """(T, rays) [m] of a range finder; NaN where nothing was measured."""
    found: Array = np.where(feed.counts == unknown, np.nan, feed.counts * feed.unit)
    return found
