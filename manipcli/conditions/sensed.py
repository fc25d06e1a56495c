"""Sensors as conditions see them: what a reading holds, and which messages of the log have it.

A condition uses the last measurement that arrived: live from the sensors of the simulation, judged from their messages.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array


@dataclass(frozen=True, slots=True)
class Sensed:
    """A sensor of the task.

    Attributes:
        type: the word under `type`.
        fields: what makes up a reading, in order: (suffix of the topic /sensors/NAME, field, float64 numbers in it).
            Empty for a camera.
        picture: of a camera: suffix of the topic of its pictures of part numbers.
        parts: of a camera that tells parts apart: their names, by their number in a picture. A reading of a camera is
            the number of pixels of each part.
        messages: suffix of a topic -> its ROS type.
        forces: of a sensor of touch: how many numbers at the start of a reading are normal forces [N].
        shear: whether as many forces along x follow, then along y.
        threshold: of a switch: the force [N] that closes it.
        topic: its topic, if that is not /sensors/NAME.
        most: quantity -> largest reading of each of its numbers: `force` [N], `torque` [N m],
            `pixels` of a camera.
    """

    type: str
    fields: tuple[tuple[str, str, int], ...] = ()
    picture: str = ""
    parts: tuple[str, ...] = ()
    messages: Mapping[str, str] = field(default_factory=dict)
    forces: int = 0
    shear: bool = False
    threshold: float | None = None
    topic: str = ""
    most: Mapping[str, float] = field(default_factory=dict)

    @property
    def width(self) -> int:
        """Numbers in a reading."""
        return len(self.parts) or sum(count for _, _, count in self.fields)

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Of the topics with its readings."""
        return (self.picture,) if self.parts else tuple(dict.fromkeys(suffix for suffix, _, _ in self.fields))


NO_SENSORS: Final[Mapping[str, Sensed]] = {}
FELT: Final = "felt_force"
"""Name of what the arm feels at its tool: it is read like a sensor, and published like a broadcaster."""
WRENCH: Final = "geometry_msgs/msg/WrenchStamped"
FELT_FORCE: Final = Sensed(FELT, fields=(("", "wrench", 6),), messages={"": WRENCH}, topic=f"/{FELT}/wrench")


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
