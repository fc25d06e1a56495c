"""The contract of sensors: the true state in, a reading out, once per control tick before the controllers are updated.

A controller asks for sensors with `sensors`, a `SensorRequest` each; the session opens them on its engine and hands the
controller their readings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from manipcli.control.controller import SensorRequest
from manipcli.core.geometry import Array
from manipcli.model.state import WorldState
from manipcli.simulate.engine import Engine


class Sensor(Protocol):
    """A sensor of a running engine."""

    @property
    def reading(self) -> Array:
        """(width) what was sensed last, zeros before; the same array for the sensor's life."""
        ...

    def sense(self, state: WorldState, rng: np.random.Generator) -> Array:
        """The reading in this state of the world, written into `reading`; all randomness comes from `rng`."""
        ...


@dataclass(frozen=True, slots=True)
class SensorMember:
    """A member of the seam.

    Attributes:
        name: of the sensor, in requests; the log has what a broadcaster publishes of it in `/CONTROLLER/<name>`.
        message: ROS type of that topic, one for which `record/write/rows.py` has a template.
        width: how many numbers a reading has, in the order of the message.
        open: (engine, request) -> the sensor, which may ask the engine to measure from now on.
    """

    name: str
    message: str
    width: int
    open: Callable[[Engine, SensorRequest], Sensor]
