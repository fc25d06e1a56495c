"""Contract of sensors: the true state in, a reading out, once per control tick before the controllers are updated.

A controller requests sensors with `sensors`, a `SensorRequest` each; the session opens them on its engine and passes
their readings to the controller.
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
        """(width) the last reading, zeros before the first; always the same array."""
        ...

    def sense(self, state: WorldState, rng: np.random.Generator) -> Array:
        """Write the reading for this state into `reading`; all randomness comes from `rng`."""
        ...


@dataclass(frozen=True, slots=True)
class SensorMember:
    """A member of the seam.

    Attributes:
        name: of the sensor, in requests; a broadcaster publishes it in the log as `/CONTROLLER/<name>`.
        message: ROS type of that topic: a header and `width` float64 fields.
        width: numbers in a reading, in the order of the message.
        open: (engine, request) -> the sensor, which may register with the engine.
        definition: ros2msg text of the type; "" for a type that `record/schemas.py` has.
    """

    name: str
    message: str
    width: int
    open: Callable[[Engine, SensorRequest], Sensor]
    definition: str = ""
