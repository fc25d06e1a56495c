"""Largest efforts of the motors at the joints of a robot."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.drivetrain import Drivetrain
from manipcli.model.robot import RobotModel

_PLENTY: Final = 1e9
"""Represents an unlimited effort in sums [N m or N]."""


def motor_effort_limits(robot: RobotModel) -> Array:
    """(n) the largest effort of an engine's own motor at each joint [N m or N]; infinite where unlimited.

    The smaller of the joint's limit and the output of its actuator while it drives, less losses and Coulomb friction.
    The two joints of a pair get the largest common multiple of their individual limits that both can have at once.
    """
    limits = np.array(
        [math.inf if joint.limits.effort is None else joint.limits.effort for joint in robot.moving_joints],
        dtype=np.float64,
    )
    drivetrain = Drivetrain.of(robot)
    actuators, joints = list(drivetrain.actuators), list(drivetrain.joints)
    for block in drivetrain.transmission.blocks:
        own, actuators = actuators[: block.size], actuators[block.size :]
        driven, joints = joints[: block.size], joints[block.size :]
        if all(actuator.effort is None for actuator in own):
            continue
        net = np.array(
            [max((_PLENTY if x.effort is None else x.effort) * x.efficiency - x.coulomb_friction, 0.0) for x in own]
        )
        alone = np.abs(block.maps.joint_effort) @ net
        need = np.abs(block.maps.actuator_effort) @ alone
        share = np.min(net / np.where(need > 0.0, need, 1.0))
        limits[driven] = np.minimum(limits[driven], share * alone)
    return limits


def effort_limits(robot: RobotModel) -> tuple[Array, Array]:
    """(n) the efforts [N m or N] at which the motor of each joint is at its limit: without losses, and while it drives.

    The first is the smaller of the joint's limit and the output of its actuator without losses and friction. From the
    second, `motor_effort_limits`, viscous friction takes more.
    """
    ideal = replace(
        robot,
        actuators=tuple(replace(actuator, efficiency=1.0, coulomb_friction=0.0) for actuator in robot.actuators),
    )
    return motor_effort_limits(ideal), motor_effort_limits(robot)


def viscous_friction(robot: RobotModel) -> Array:
    """(n) viscous friction of the actuators at each joint [N m s/rad or N s/m], without coupling between joints."""
    drivetrain = Drivetrain.of(robot)
    friction = np.zeros(len(robot.joint_names))
    if drivetrain.actuators:
        viscous = np.array([actuator.viscous_friction for actuator in drivetrain.actuators])
        friction[list(drivetrain.joints)] = viscous @ drivetrain.transmission.maps.actuator_motion**2
    return friction
