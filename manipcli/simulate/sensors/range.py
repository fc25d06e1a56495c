"""`range`: distances along rays, as a laser scanner or a laser distance sensor measures them.

    sensors:
      scanner:
        type: range
        link: base_link
        at: {xyz: [0.2, 0, 0.1]}
        rays: 683
        angle: 240 deg
        limits: {least: 2 cm, most: 5.6 m}

The rays lie in the plane z = 0 of its frame S, equally spaced about x; a single ray points along x. One ray publishes
sensor_msgs/Range in /sensors/NAME, more publish sensor_msgs/LaserScan. Nearer than `least` is -infinity, farther than
`most` or nothing is infinity (REP 117). Rays see the visual shapes of robot and scene.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.render.scan import Scan
from manipcli.render.stage import stage_of
from manipcli.simulate.sensor import Quantity, SensorContext, SensorMember, Topic
from manipcli.spec.mounted_sensor import MountedSpec
from manipcli.spec.quantity import Angle, Frequency
from manipcli.spec.sensors import LengthLimits, LengthNoise, SensorNoise

_INFRARED = 1
"""Range.INFRARED: of light."""


class RangeNoise(SensorNoise):
    """Noise of a range finder."""

    distance: LengthNoise = Field(LengthNoise(), description="Noise of distances. Default: none.")


class RangeSpec(MountedSpec):
    """A range finder: one ray, or many in a plane."""

    type: Literal["range"] = Field(description="A range finder.")
    rate: Annotated[Frequency, Field(gt=0)] | None = Field(
        50.0, description="Measurements [Hz]: the control rate divided by a whole number. Default 50 Hz."
    )
    rays: Annotated[int, Field(ge=1, le=10_000)] = Field(
        1, description="Number of rays: 1 publishes a Range, more publish a LaserScan. Default 1."
    )
    angle: Annotated[Angle, Field(gt=0, le=6.2832)] = Field(
        3.141592653589793, description="Angle from the first ray to the last one; x is in the middle. Default 180 deg."
    )
    noise: RangeNoise = Field(RangeNoise(), description="Noise. Default: none.")
    limits: LengthLimits = Field(LengthLimits(), description="Distances that it measures. Default: up to 100 m.")

    @property
    def angles(self) -> Array:
        """(rays) from x towards y [rad]."""
        return np.zeros(1) if self.rays == 1 else np.linspace(-self.angle / 2.0, self.angle / 2.0, self.rays)


def quantities(spec: RangeSpec, robot: RobotModel) -> tuple[Quantity, ...]:
    """A distance per ray."""
    return (Quantity("distance", spec.rays, spec.noise.distance),)


def topics(spec: RangeSpec, robot: RobotModel) -> tuple[Topic, ...]:
    """A Range, or a LaserScan."""
    if spec.rays == 1:
        constant = {"radiation_type": _INFRARED, "min_range": spec.limits.least, "max_range": spec.limits.most}
        return (Topic("sensor_msgs/msg/Range", filled=("range",), constant=constant),)
    scan = {
        "angle_min": -spec.angle / 2.0,
        "angle_max": spec.angle / 2.0,
        "angle_increment": spec.angle / (spec.rays - 1),
        "scan_time": 0.0 if spec.rate is None else 1.0 / spec.rate,
        "range_min": spec.limits.least,
        "range_max": spec.limits.most,
        "ranges": np.zeros(spec.rays),
    }
    return (Topic("sensor_msgs/msg/LaserScan", filled=("ranges",), constant=scan),)


class RangeProbe:
    """Reads the distances along the rays."""

    def __init__(self, spec: RangeSpec, context: SensorContext) -> None:
        assert context.mount is not None
        self._mount = context.mount
        self._least = spec.limits.least
        self._stage = stage_of(context.robot, context.scene)
        self._scan = Scan(self._stage.surfaces, spec.angles, spec.limits.most)

    def read(self, state: WorldState) -> Array:
        found = self._scan.distances(*self._stage.poses(state, self._mount.pose(state)))
        found[found < self._least] = -np.inf
        return found


MEMBER = SensorMember(name="range", spec=RangeSpec, quantities=quantities, topics=topics, open=RangeProbe)
