"""What actuators do when joints do what they do: the other side of the transmissions."""

from __future__ import annotations

from manipcli.core.geometry import Array
from manipcli.model.drivetrain import Drivetrain
from manipcli.model.robot import RobotModel


class ActuatorSide:
    """The actuators of a robot, in the order of its transmissions.

    Attributes:
        names: (a) of the actuators.
    """

    def __init__(self, robot: RobotModel) -> None:
        drivetrain = Drivetrain.of(robot)
        self.names = drivetrain.names
        self._columns = list(drivetrain.joints)
        self._transmission = drivetrain.transmission

    def values(self, position: Array, velocity: Array, effort: Array) -> list[Array]:
        """Position, velocity and effort of the actuators, each (T, a), from those of all joints (T, n)."""
        to_actuator, columns = self._transmission.joint_to_actuator, self._columns
        return [
            to_actuator("position", position[:, columns]),
            to_actuator("velocity", velocity[:, columns]),
            to_actuator("effort", effort[:, columns]),
        ]
