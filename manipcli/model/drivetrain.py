"""Drivetrain of a robot: all its transmissions combined into one with block matrices."""

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
    """Several transmissions in a row: the actuators and joints of the first, then those of the second, ..."""

    blocks: tuple[Transmission, ...]

    @cached_property
    def maps(self) -> Maps:
        blocks = [block.maps for block in self.blocks]
        return Maps.of(
            joint_motion=_diagonal([maps.joint_motion for maps in blocks]),
            actuator_motion=_diagonal([maps.actuator_motion for maps in blocks]),
            joint_effort=_diagonal([maps.joint_effort for maps in blocks]),
            actuator_effort=_diagonal([maps.actuator_effort for maps in blocks]),
            offset=np.concatenate([maps.offset for maps in blocks]) if blocks else [],
        )


@dataclass(frozen=True, slots=True)
class Drivetrain:
    """The a actuators of a robot and the a joints that they drive.

    Attributes:
        actuators: (a) their parameters; ideal if unknown.
        joints: (a) indices of the driven joints in a joint vector, in the order of `transmission`.
        transmission: between the actuators and these joints.
    """

    actuators: tuple[Actuator, ...]
    joints: tuple[int, ...]
    transmission: BlockTransmission

    @staticmethod
    def of(robot: RobotModel) -> Drivetrain:
        """The drivetrain in the order of `robot.transmissions`.

        Skipped are transmissions that the checks of descriptions report: of unknown type, with a wrong number of
        joints, with joints that cannot be commanded, and a second one of the same joint (ROS 1 and ros2_control may
        both describe it).
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
        """(a) names of the actuators."""
        return tuple(actuator.name for actuator in self.actuators)

    def state(self, position: Array, velocity: Array, effort: Array) -> list[Array]:
        """Position, velocity and effort of the actuators, each (T, a), from those of all joints (T, n).

        The effort is that at the gear, after friction, losses and limits of the actuators.
        """
        to_actuator, columns = self.transmission.joint_to_actuator, list(self.joints)
        return [
            to_actuator("position", position[:, columns]),
            to_actuator("velocity", velocity[:, columns]),
            to_actuator("effort", effort[:, columns]),
        ]


def reflected_inertia(robot: RobotModel) -> Array:
    """(n) reflected rotor inertia of each joint [kg m2 or kg]: the diagonal of T^T J T.

    velocity_a = T velocity_j and J is the rotor inertia; for a simple transmission reduction^2 J. The coupling between
    the two joints of a pair (off the diagonal) is neglected.
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
