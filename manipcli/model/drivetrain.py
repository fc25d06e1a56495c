"""All actuators of a robot: its transmissions side by side, as one transmission of block matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.transmission import Maps, Transmission
from manipcli.model.transmissions import BY_TYPE


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
        names: (a) of the actuators.
        joints: (a) where the joints that they drive stand in a joint vector, in the order of `transmission`.
        transmission: from the actuators to those joints.
    """

    names: tuple[str, ...]
    joints: tuple[int, ...]
    transmission: BlockTransmission

    @staticmethod
    def of(robot: RobotModel) -> Drivetrain:
        """In the order of `robot.transmissions`. Those of an unknown type, and of joints that nobody commands, are left
        out, as the checks of the description tell."""
        commanded = {joint.name for joint in robot.moving_joints if joint.independent}
        tags = [tag for tag in robot.transmissions if tag.type in BY_TYPE and commanded.issuperset(tag.joints)]
        return Drivetrain(
            names=tuple(name for tag in tags for name in tag.actuators),
            joints=tuple(robot.indices(tuple(name for tag in tags for name in tag.joints))),
            transmission=BlockTransmission(tuple(BY_TYPE[tag.type].of(tag, robot.compat) for tag in tags)),
        )


def _diagonal(blocks: Sequence[Array]) -> Array:
    whole = np.zeros((sum(len(block) for block in blocks),) * 2)
    at = 0
    for block in blocks:
        end = at + len(block)
        whole[at:end, at:end] = block
        at = end
    return whole
