"""Sensors as conditions see them: what a reading holds, and which messages of the log have it.

A condition uses the last measurement that arrived: live from the sensors of the simulation, judged from their messages.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array


@dataclass(frozen=True, slots=True)
class Sensed:
    """A sensor of the task.

    Attributes:
        type: the word under `type`.
        suffix: of the topic /sensors/NAME with its readings.
        message: ROS type of this topic.
        fields: their fields that make up a reading, in order, each (name, float64 numbers). Empty for a camera.
        parts: of a camera that tells parts apart: their names, by their number in a picture. A reading of a camera is
            the number of pixels of each part.
        forces: of a sensor of touch: how many numbers at the start of a reading are normal forces [N].
        threshold: of a switch: the force [N] that closes it.
    """

    type: str
    suffix: str = ""
    message: str = ""
    fields: tuple[tuple[str, int], ...] = ()
    parts: tuple[str, ...] = ()
    forces: int = 0
    threshold: float | None = None

    @property
    def width(self) -> int:
        """Numbers in a reading."""
        return len(self.parts) or sum(count for _, count in self.fields)


NO_SENSORS: Final[Mapping[str, Sensed]] = {}


@dataclass(frozen=True, slots=True)
class Readings:
    """What a sensor measured: `values` (K, width) arrived at `times` (K,) [s], ascending, and hold until the next."""

    times: Array
    values: Array

    def at(self, times: Array) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
        """(T,) the index of the reading that holds at each of `times`, and whether there is one."""
        last = np.searchsorted(self.times, times, side="right") - 1
        return np.maximum(last, 0), last >= 0

    def then(self, later: Readings) -> Readings:
        """The last of these readings, followed by later ones."""
        return Readings(
            np.concatenate([self.times[-1:], later.times]), np.concatenate([self.values[-1:], later.values])
        )


def pixels_of_parts(data: bytes | memoryview, encoding: str, count: int) -> Array:
    """(count) the number of pixels of each part in a picture of part numbers, 8UC1 or 16UC1."""
    numbers = np.frombuffer(data, np.uint8 if encoding == "8UC1" else "<u2")
    return np.bincount(numbers, minlength=count)[:count].astype(np.float64)
