"""What actuators do when joints do what they do: the other side of the transmissions."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.transmission import Quantity, SimpleTransmission


class ActuatorSide:
    """The actuators of a robot's simple transmissions, in the order of its description.

    Attributes:
        names: of the actuators; of the transmission where its actuator has no name.
    """

    def __init__(self, robot: RobotModel) -> None:
        simple = [
            tag
            for tag in robot.transmissions
            if len(tag.joints) == 1 and len(tag.actuators) <= 1 and tag.joints[0] in robot.joint_names
        ]
        self.names = tuple(tag.actuators[0] if tag.actuators else tag.name for tag in simple)
        self._columns = robot.indices(tuple(tag.joints[0] for tag in simple))
        self._transmissions = [SimpleTransmission.of(tag) for tag in simple]

    def values(self, position: Array, velocity: Array, effort: Array) -> list[Array]:
        """Position, velocity and effort of the actuators, each (T, k), from those of all joints (T, n)."""
        return [self._of("position", position), self._of("velocity", velocity), self._of("effort", effort)]

    def _of(self, quantity: Quantity, joints: Array) -> Array:
        values = np.empty((len(joints), len(self.names)))
        for k, (column, transmission) in enumerate(zip(self._columns, self._transmissions, strict=True)):
            values[:, k] = transmission.joint_to_actuator(quantity, joints[:, column])
        return values
