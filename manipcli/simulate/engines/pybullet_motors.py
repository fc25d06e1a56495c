"""Commands to Bullet's joints: torques, and Bullet's motors as servo drives.

A motor is Bullet's constraint on a joint's speed, limited by the joint's effort; gravity and contacts act against it.
Joints with effort commands have no motor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import ModuleType

from manipcli.control.command import JointCommand, Mode
from manipcli.model.motor_limits import motor_effort_limits
from manipcli.model.robot import RobotModel
from manipcli.simulate.engines.conventions import POSITION_TIME, UNLIMITED_EFFORT


class Motors:
    """Commands of the moving joints of one robot.

    Args:
        p, client, body: PyBullet, its world, the robot in it.
        joints: (n) Bullet's indices of the robot's moving joints.
        robot: the robot.
        step: [s] of the physics.
    """

    def __init__(
        self, p: ModuleType, client: int, body: int, joints: Sequence[int], robot: RobotModel, step: float
    ) -> None:
        self._p, self._client, self._body, self._joints = p, client, body, list(joints)
        self._stiffness = -math.expm1(-step / POSITION_TIME)
        self._efforts = [min(float(effort), UNLIMITED_EFFORT) for effort in motor_effort_limits(robot)]
        limits = [joint.limits for joint in robot.moving_joints]
        self._velocities = [math.inf if limit.velocity is None else limit.velocity for limit in limits]
        self._version = -1
        self._applied = [0.0] * len(self._joints)  # besides the motors' own
        self._measures = False
        self._torques_at: list[int] = []
        self._torque_joints: list[int] = []
        self._torques: list[float] = []
        self._motors: list[tuple[int, int, Mode]] = []
        self._release(self._joints)

    def write(self, command: JointCommand) -> None:
        """Set the command until the next one."""
        if command.version != self._version:
            self._obey(command)
        p, client = self._p, self._client
        if len(self._torques_at) == len(self._joints):
            self._torques = self._applied = command.effort.tolist()
        elif self._torques_at:
            efforts = command.effort.tolist()
            self._torques = [efforts[k] for k in self._torques_at]
            for k in self._torques_at:
                self._applied[k] = efforts[k]
        for row, joint, mode in self._motors:
            if mode == "position":
                p.setJointMotorControl2(
                    self._body,
                    joint,
                    p.POSITION_CONTROL,
                    targetPosition=float(command.position[row]),
                    targetVelocity=float(command.velocity[row]),
                    positionGain=self._stiffness,
                    force=self._efforts[row],
                    maxVelocity=self._velocities[row],
                    physicsClientId=client,
                )
            else:
                p.setJointMotorControl2(
                    self._body,
                    joint,
                    p.VELOCITY_CONTROL,
                    targetVelocity=float(command.velocity[row]),
                    force=self._efforts[row],
                    physicsClientId=client,
                )

    def efforts(self, states: Sequence[tuple[float, float, tuple[float, ...], float]]) -> list[float]:
        """(n) effort on each joint [N m or N]: the commanded one, plus that of its motor in Bullet's joint states."""
        if not self._measures:
            return self._applied
        return [state[3] + applied for state, applied in zip(states, self._applied, strict=True)]

    def _obey(self, command: JointCommand) -> None:
        """Switch motors on or off after a change of modes."""
        self._version = command.version
        modes = command.modes
        self._torques_at = [k for k, mode in enumerate(modes) if mode in ("effort", "position")]
        self._torque_joints = [self._joints[k] for k in self._torques_at]
        self._torques = [0.0] * len(self._torques_at)
        self._motors = [(k, self._joints[k], mode) for k, mode in enumerate(modes) if mode in ("position", "velocity")]
        self._measures = bool(self._motors) or "brake" in modes
        self._applied = [0.0] * len(modes)
        for k, mode in enumerate(modes):
            if mode == "brake":
                self._brake(k)
        released = [self._joints[k] for k, mode in enumerate(modes) if mode in ("effort", "free")]
        self._release(released)

    def _brake(self, k: int) -> None:
        p, joint = self._p, self._joints[k]
        p.setJointMotorControl2(
            self._body, joint, p.VELOCITY_CONTROL, targetVelocity=0.0, force=self._efforts[k],
            physicsClientId=self._client,
        )  # fmt: skip

    def _release(self, joints: list[int]) -> None:
        """Switch the motors of these joints off."""
        p = self._p
        if joints:
            none = [0.0] * len(joints)
            p.setJointMotorControlArray(
                self._body, joints, p.VELOCITY_CONTROL, forces=none, physicsClientId=self._client
            )

    def push(self) -> None:
        """Apply torques for the next physics step: Bullet clears them after each step."""
        p = self._p
        if self._torque_joints:
            p.setJointMotorControlArray(
                self._body, self._torque_joints, p.TORQUE_CONTROL, forces=self._torques, physicsClientId=self._client
            )
