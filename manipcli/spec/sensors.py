"""Specs that sensors have in common: rate, delay and noise.

A member of `simulate/sensors/` derives its spec from the classes of `mounted_sensor.py`, its block `noise` from
`SensorNoise` and its block `limits` from `Model`, each with a field for every quantity; `unions` builds the union by
`type`.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Final, Generic, TypeVar

from pydantic import AfterValidator, Field, model_validator

from manipcli.core import units
from manipcli.core.text import escape
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import (
    Acceleration,
    Force,
    Frequency,
    JointEffort,
    JointValue,
    JointVelocity,
    Length,
    Share,
    Time,
    Torque,
    Unit,
)

Q = TypeVar("Q", bound=float)

AngularVelocity = Annotated[float, Unit((units.ANGULAR_VELOCITY,))]
_NAME: Final = re.compile(r"[A-Za-z]\w{0,99}", re.ASCII)


def _names_a_topic(name: str) -> str:
    if not _NAME.fullmatch(name):
        hint = "use letters, digits and '_', at most 100; begin with a letter: it names a topic and a frame"
        raise problem("conflict", f"'{escape(name)}' is not a valid name of a sensor", key=True, hint=hint)
    return name


SensorName = Annotated[str, AfterValidator(_names_a_topic)]


_ZERO: Any = 0.0  # of any quantity


class Noise(Model, Generic[Q]):
    """Noise of one quantity, in its unit."""

    white: Annotated[Q, Field(ge=0)] = Field(_ZERO, description="Standard deviation of each measurement. Default 0.")
    bias: Annotated[Q, Field(ge=0)] = Field(
        _ZERO, description="Standard deviation of the offset that is drawn once per run. Default 0."
    )
    walk: Annotated[Q, Field(ge=0)] = Field(
        _ZERO, description="Standard deviation of the drift of the offset (a random walk) after 1 s. Default 0."
    )
    quantisation: Annotated[Q, Field(ge=0)] = Field(
        _ZERO, description="Step to whose multiples measurements are rounded. Default 0: not rounded."
    )


class ForceNoise(Noise[Force]):
    """Noise of a force [N]."""


class TorqueNoise(Noise[Torque]):
    """Noise of a torque [N m]."""


class PositionNoise(Noise[JointValue]):
    """Noise of positions of joints [rad or m]."""


class VelocityNoise(Noise[JointVelocity]):
    """Noise of velocities of joints [rad/s or m/s]."""


class EffortNoise(Noise[JointEffort]):
    """Noise of efforts of joints [N m or N]."""


class AngularVelocityNoise(Noise[AngularVelocity]):
    """Noise of an angular velocity [rad/s]."""


class AccelerationNoise(Noise[Acceleration]):
    """Noise of an acceleration [m/s^2]."""


class LengthNoise(Noise[Length]):
    """Noise of a distance [m]."""


class LengthLimits(Model):
    """Distances that can be measured."""

    least: Annotated[Length, Field(ge=0)] = Field(0.0, description="Smallest distance [m]. Default 0.")
    most: Annotated[Length, Field(gt=0, le=1000)] = Field(100.0, description="Largest distance [m]. Default 100 m.")

    @model_validator(mode="after")
    def _in_order(self) -> LengthLimits:
        if self.least >= self.most:
            message = f"'least' ({self.least:g} m) is not below 'most' ({self.most:g} m)"
            raise problem("range", message, at=("least",))
        return self


class SensorNoise(Model):
    """What every sensor may lose; members add a block for each quantity."""

    dropout: Annotated[Share, Field(ge=0, le=1)] = Field(
        0.0, description="Share of measurements that never arrive, 0 to 1. Default 0."
    )


class SensorSpec(Model):
    """A sensor: how often it measures, and what is lost between the truth and the reading."""

    # Members narrow `type` to their word, and `noise` and `limits` to their quantities.
    type: str = Field(description="Type of the sensor.")
    rate: Annotated[Frequency, Field(gt=0)] | None = Field(
        None, description="Measurements [Hz]: the control rate divided by a whole number. Default: the control rate."
    )
    delay: Annotated[Time, Field(ge=0, le=10)] = Field(
        0.0, description="Time from a measurement to its arrival, whole control periods, up to 10 s. Default 0."
    )
    noise: SensorNoise = Field(SensorNoise(), description="Noise. Default: none.")
