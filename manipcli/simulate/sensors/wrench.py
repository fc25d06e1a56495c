"""A force/torque sensor between a link and its parent: the wrench of the link on the parent, in the link's frame."""

from __future__ import annotations

import numpy as np

from manipcli.control.controller import SensorRequest
from manipcli.core.geometry import Array
from manipcli.model.state import WorldState
from manipcli.simulate.engine import Engine
from manipcli.simulate.sensor import SensorMember


class WrenchSensor:
    """Reads (6): force [N] and torque [N m] about the link's origin, as `Engine.sense_wrench` measures them."""

    def __init__(self, engine: Engine, request: SensorRequest) -> None:
        self._measured = engine.sense_wrench(request.joint)
        self.reading = np.zeros(6)

    def sense(self, state: WorldState, rng: np.random.Generator) -> Array:
        self.reading[:] = self._measured
        return self.reading


MEMBER = SensorMember(name="wrench", message="geometry_msgs/msg/WrenchStamped", width=6, open=WrenchSensor)
