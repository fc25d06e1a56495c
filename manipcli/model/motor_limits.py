"""Largest efforts of the motors at the joints of a robot, and when they are reached."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.model.drivetrain import Drivetrain
from manipcli.model.robot import RobotModel

NEAR: Final = 1e-6
"""Share of a limit within which an effort is at it: engines keep the limit as an impulse, with rounding."""
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


@dataclass(frozen=True, slots=True)
class EffortLimits:
    """What limits the effort of n joints with a actuators.

    Attributes:
        joint: (n) limits of the joints [N m or N]; infinite where unlimited.
        motor: (n) `motor_effort_limits`, which an engine's own motors reach exactly.
        effort, motion: (a, n) efforts and velocities of the joints to those of the actuators.
        actuator: (a) limits of the actuators.
        output: (a) what reaches the gear of an actuator at its limit while it drives, less viscous friction.
        viscous: (a) viscous friction of the actuators.
    """

    joint: Array
    motor: Array
    effort: Array
    motion: Array
    actuator: Array
    output: Array
    viscous: Array

    @staticmethod
    def of(robot: RobotModel) -> EffortLimits:
        """The limits of a robot."""
        drivetrain = Drivetrain.of(robot)
        actuators, columns, n = drivetrain.actuators, list(drivetrain.joints), len(robot.joint_names)
        effort, motion = np.zeros((2, len(actuators), n))
        if actuators:
            effort[:, columns] = drivetrain.transmission.maps.actuator_effort
            motion[:, columns] = drivetrain.transmission.maps.actuator_motion
        limits = np.array([math.inf if x.effort is None else x.effort for x in actuators])
        efficiency = np.array([x.efficiency for x in actuators])
        coulomb = np.array([x.coulomb_friction for x in actuators])
        return EffortLimits(
            joint=np.array([math.inf if x.limits.effort is None else x.limits.effort for x in robot.moving_joints]),
            motor=motor_effort_limits(robot),
            effort=effort,
            motion=motion,
            actuator=limits,
            output=np.maximum(limits * efficiency - coulomb, 0.0),
            viscous=np.array([x.viscous_friction for x in actuators]),
        )

    @property
    def least(self) -> Array:
        """(n) the smaller of the limits of a joint and its motor; infinite without, 0 for a joint without effort."""
        return np.minimum(self.joint, self.motor)

    def reached(self, effort: Array, velocity: Array) -> npt.NDArray[np.bool_]:
        """(T, n) whether each joint, or an actuator that drives it, is at its limit.

        An actuator gives its limit at rest and while it brakes, and `output` less viscous friction while it drives.

        Args:
            effort, velocity: (T, n) measured.
        """
        size, gear = np.abs(effort), effort @ self.effort.T
        speed = velocity @ self.motion.T
        driving = gear * speed > 0.0
        lost = self.output * (1.0 - NEAR) - self.viscous * np.abs(speed)
        full = (np.abs(gear) >= (1.0 - NEAR) * self.actuator) | (driving & (np.abs(gear) >= lost))
        of_actuators = full.astype(float) @ (self.effort != 0.0).astype(float) > 0.0
        at_motor = np.abs(size - np.where(np.isfinite(self.motor), self.motor, 0.0)) <= NEAR * self.motor
        at_motor &= np.isfinite(self.motor)
        return np.asarray((size >= (1.0 - NEAR) * self.joint) | at_motor | of_actuators)
