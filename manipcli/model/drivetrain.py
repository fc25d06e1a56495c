"""All actuators of a robot: its transmissions side by side, as one transmission of block matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manipcli.core.geometry import Array
from manipcli.description.elements import TransmissionTag
from manipcli.description.transmission import Maps, Transmission
from manipcli.description.transmissions import BY_TYPE
from manipcli.model.robot import Actuator, RobotModel


@dataclass(frozen=True)
class BlockTransmission(Transmission):
    """Transmissions side by side: the actuators of the first, then those of the second, and so the joints."""

    blocks: tuple[Transmission, ...]

    @cached_property
    def maps(self) -> Maps:
        each = [block.maps for block in self.blocks]
        return Maps.of(
            joint_motion=_diagonal([maps.joint_motion for maps in each]),
            actuator_motion=_diagonal([maps.actuator_motion for maps in each]),
            joint_effort=_diagonal([maps.joint_effort for maps in each]),
            actuator_effort=_diagonal([maps.actuator_effort for maps in each]),
            offset=np.concatenate([maps.offset for maps in each]) if each else [],
        )


@dataclass(frozen=True, slots=True)
class Drivetrain:
    """The a actuators of a robot, which drive as many of its joints.

    Attributes:
        actuators: (a) what is known of each; ideal where nothing is.
        joints: (a) where the joints that they drive stand in a joint vector, in the order of `transmission`.
        transmission: from the actuators to those joints.
    """

    actuators: tuple[Actuator, ...]
    joints: tuple[int, ...]
    transmission: BlockTransmission

    @staticmethod
    def of(robot: RobotModel) -> Drivetrain:
        """In the order of `robot.transmissions`.

        Left out are those that the checks of descriptions tell of: of an unknown type or a wrong number of joints, of
        joints that nobody commands, and a second one of the same joint (ROS 1 and ros2_control may both describe it).
        """
        known = {actuator.name: actuator for actuator in robot.actuators}
        free = {joint.name for joint in robot.moving_joints if joint.independent}
        tags: list[TransmissionTag] = []
        for tag in robot.transmissions:
            member = BY_TYPE.get(tag.type)
            if (
                member is not None
                and len(tag.joints) == len(tag.actuators) == member.size
                and free.issuperset(tag.joints)
            ):
                free.difference_update(tag.joints)
                tags.append(tag)
        return Drivetrain(
            actuators=tuple(known.get(name, Actuator(name)) for tag in tags for name in tag.actuators),
            joints=tuple(robot.indices(tuple(name for tag in tags for name in tag.joints))),
            transmission=BlockTransmission(tuple(BY_TYPE[tag.type].of(tag, robot.compat) for tag in tags)),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """(a) of the actuators."""
        return tuple(actuator.name for actuator in self.actuators)

    def state(self, position: Array, velocity: Array, effort: Array) -> list[Array]:
        """Position, velocity and effort of the actuators, each (T, a), from those of all joints (T, n).

        The effort is what reaches the gear: friction, losses and limits of the actuators are in it already.
        """
        to_actuator, columns = self.transmission.joint_to_actuator, list(self.joints)
        return [
            to_actuator("position", position[:, columns]),
            to_actuator("velocity", velocity[:, columns]),
            to_actuator("effort", effort[:, columns]),
        ]


def reflected_inertia(robot: RobotModel) -> Array:
    """(n) [kg m2 or kg] what the rotors add to the inertia of each joint: the diagonal of T^T J T.

    velocity_a = T velocity_j and J the rotors' own inertia; for a simple transmission reduction^2 J. What couples the
    two joints of a pair (the rest of the matrix) is left out.
    """
    drivetrain = Drivetrain.of(robot)
    inertia = np.zeros(len(robot.joint_names))
    if drivetrain.actuators:
        rotors = np.array([actuator.rotor_inertia for actuator in drivetrain.actuators])
        inertia[list(drivetrain.joints)] = rotors @ drivetrain.transmission.maps.actuator_motion**2
    return inertia


def _diagonal(blocks: Sequence[Array]) -> Array:
    whole = np.zeros((sum(len(block) for block in blocks),) * 2)
    at = 0
    for block in blocks:
        end = at + len(block)
        whole[at:end, at:end] = block
        at = end
    return whole
