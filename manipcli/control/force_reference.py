"""Force control by a moving reference: a spring whose reference shifts until the measured force is the wanted one.

The tool presses along an axis of its frame with p = f_0 - f, where f is the measured force along that axis and f_0 its
mean over the first 0.1 s: the weight of the hand and the offset of the sensor. The reference of a spring of stiffness k
along the axis is shifted by s,

    s' = 2 pi bandwidth (target - p) / k,    |s'| <= speed,    |s| <= reach.

In contact with something stiff p' = k s', so that p tends to the target as exp(-2 pi bandwidth t). In free space the
tool moves at `speed` until it touches something. Integral control of the force error: Siciliano and Villani, Robot
Force Control (1999), chapter 3.
"""

from __future__ import annotations

import math
from typing import Annotated, Final, Literal

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array
from manipcli.spec.base import Model
from manipcli.spec.quantity import Force, Frequency, Length, Speed

ZEROING: Final = 0.1
"""[s] for which the reading is averaged after the activation; nothing moves."""
AXES: Final = {"x": 0, "y": 1, "z": 2}


class ForceReferenceSpec(Model):
    """A force that the tool exerts along one of its axes, closed over a force/torque sensor."""

    sensor: str = Field(
        description="Name of a sensor `force_torque` of the robot or task, with axes parallel to those of the tool. "
        "It is zeroed over 0.1 s when the controller is activated."
    )
    axis: Literal["x", "y", "z"] = Field(description="Axis of the tool frame.")
    target: Annotated[Force, Field(ge=-1e5, le=1e5)] = Field(
        description="Force of the tool on what it touches, along the axis [N]; negative: against it."
    )
    bandwidth: Annotated[Frequency, Field(gt=0, le=100)] = Field(
        1.0, description="Bandwidth of the force in stiff contact [Hz], up to 100 Hz. Default 1 Hz."
    )
    speed: Annotated[Speed, Field(gt=0, le=1)] = Field(
        0.02, description="Largest speed of the reference, and of the tool before contact [m/s]. Default 2 cm/s."
    )
    reach: Annotated[Length, Field(gt=0, le=1)] = Field(
        0.05, description="Largest shift of the reference [m]. Default 5 cm."
    )


class ForceReference:
    """The shift of a reference.

    Args:
        spec: of the force.
        stiffness: along its axis [N/m], above 0.

    Attributes:
        axis: (3) of the tool frame.
        reading: (6) what the sensor measures; replaced by `attach` of the controller.
        shift: s [m].
    """

    def __init__(self, spec: ForceReferenceSpec, stiffness: float) -> None:
        self._spec = spec
        self._rate = math.tau * spec.bandwidth / stiffness
        self._component = AXES[spec.axis]
        self.axis: Array = np.eye(3)[self._component]
        self.reading: Array = np.zeros(6)
        self.reset()

    def reset(self) -> None:
        """Back to no shift; the sensor is zeroed by the next updates."""
        self.shift = 0.0
        self._sum, self._count, self._zeroed = 0.0, 0, 0.0

    def update(self, period: float) -> float:
        """The shift after one update of the length `period` [s]."""
        force, spec = float(self.reading[self._component]), self._spec
        if self._zeroed < ZEROING:
            self._sum += force
            self._count += 1
            self._zeroed += period
            return self.shift
        pressing = self._sum / self._count - force
        step = min(max(self._rate * (spec.target - pressing), -spec.speed), spec.speed) * period
        self.shift = min(max(self.shift + step, -spec.reach), spec.reach)
        return self.shift
