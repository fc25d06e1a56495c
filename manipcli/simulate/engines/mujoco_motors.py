"""Commands to MuJoCo's joints: torques, and motors as servo drives, like those of Bullet.

A motor is the dry friction of its joint, with the effort limit as the largest friction: the solver finds the effort
within the limit that brings the joint to rest, against gravity and contacts. Here the joint is brought to the motor's
speed w instead of 0: between the two halves of a physics step h, the reference acceleration of the friction is set to
(w - v) / h. Joints with effort commands have no friction.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from manipcli.control.command import JointCommand
from manipcli.core.geometry import Array
from manipcli.model.motor_limits import motor_effort_limits
from manipcli.model.robot import RobotModel
from manipcli.simulate.engines.conventions import POSITION_TIME, UNLIMITED_EFFORT

LEAST_EFFORT: Final = 1e-12
"""[N m or N] Represents an effort limit of 0: MuJoCo has no friction row for 0."""
MOTOR_COMPLIANCE: Final = 0.1
"""Factor of the compliance of motors. MuJoCo's least lets a braked joint creep by some 1e-6 rad/s under its load; with
0.001, the solver misses the optimum where a motor reaches its effort limit."""
MIMIC_COMPLIANCE: Final = 0.001
"""Factor of the compliance of mimic joints, which have no limits to reach. With 1, they accelerate 2e-4 too slowly."""


class Motors:
    """Commands of the moving joints of one robot.

    Args:
        model, data: of MuJoCo; the joints are the first n degrees of freedom.
        robot: the robot.
        step: [s] of the physics.
        islands: whether the solver takes islands of bodies one by one, with copies of the compliance of constraints.

    Attributes:
        active: whether any joint has a motor or mimics another one, so that `push` is needed.
    """

    def __init__(self, model: Any, data: Any, robot: RobotModel, step: float, *, islands: bool = False) -> None:
        n = len(robot.joint_names)
        self._data = data
        self._position, self._velocity = data.qpos[:n], data.qvel[:n]
        self._torques: Array = data.qfrc_applied[:n]
        self._friction: Array = model.dof_frictionloss[:n]
        self._step, self._islands = step, islands
        self._gain = -math.expm1(-step / POSITION_TIME) / step
        self._limits = np.clip(motor_effort_limits(robot), LEAST_EFFORT, UNLIMITED_EFFORT)
        limits = [joint.limits.velocity for joint in robot.moving_joints]
        self._speeds = np.array([math.inf if limit is None else limit for limit in limits])
        self._mimics = self._rows = sum(bool(joint.mimic and not joint.mimic.curve) for joint in robot.moving_joints)
        self._compliance = np.full(self._mimics + n, MOTOR_COMPLIANCE)
        self._compliance[: self._mimics] = MIMIC_COMPLIANCE
        self._version = -1
        self._driven = self._drove = np.zeros(0, dtype=np.intp)  # now, and in the last physics step
        self._by_position = self._by_torque = np.zeros(n, dtype=np.bool_)
        self._by_speed = self._by_position
        self._all_torque = False
        self._wanted, self._target_speed = np.zeros((2, n))
        self._follows = self._mimics > 0
        self.active = self._follows

    def write(self, command: JointCommand) -> None:
        """Set the command until the next one."""
        if command.version != self._version:
            self._obey(command)
        if self._all_torque:
            self._torques[:] = command.effort
            return
        np.copyto(self._torques, command.effort, where=self._by_torque)
        if len(self._driven):
            self._wanted[:] = command.position
            np.copyto(self._target_speed, command.velocity, where=self._by_speed)

    def _obey(self, command: JointCommand) -> None:
        """Switch motors on or off after a change of modes."""
        self._version = command.version
        modes = command.modes
        driven = np.array([mode in ("position", "velocity", "brake") for mode in modes], dtype=np.bool_)
        self._driven = np.flatnonzero(driven)
        self._by_position = np.array([mode == "position" for mode in modes], dtype=np.bool_)
        self._by_speed = np.array([mode in ("position", "velocity") for mode in modes], dtype=np.bool_)
        self._by_torque = np.array([mode in ("effort", "position") for mode in modes], dtype=np.bool_)
        self._all_torque = all(mode == "effort" for mode in modes)
        self._target_speed[:] = 0.0
        self._torques[:] = 0.0
        self._drove = self._drove[:0]
        self._friction[:] = np.where(driven, self._limits, 0.0)
        self.active = self._follows or len(self._driven) > 0

    def push(self) -> None:
        """Set the speeds of the motors, between the two halves of a physics step."""
        data, compliance = self._data, self._compliance
        rows = self._rows = data.ne
        if rows > self._mimics:  # attachments keep their own compliance
            compliance = np.insert(compliance, self._mimics, np.ones(rows - self._mimics))
        self._drove = self._driven
        end = rows + len(self._driven)
        data.efc_R[:end] *= compliance[:end]
        data.efc_D[:end] /= compliance[:end]
        if self._islands and data.nisland:
            copy = data.map_efc2iefc[:end]
            data.iefc_R[copy], data.iefc_D[copy] = data.efc_R[:end], data.efc_D[:end]
        if end > rows:
            speed = self._target_speed
            if self._by_position.any():
                towards = speed + self._gain * (self._wanted - self._position)
                np.clip(towards, -self._speeds, self._speeds, out=towards)
                speed = np.where(self._by_position, towards, speed)
            data.efc_aref[rows:end] = (speed - self._velocity)[self._driven] / self._step

    def efforts(self, out: Array) -> None:
        """(n) effort on each joint [N m or N] in the last physics step: the commanded one, plus that of its motor."""
        out[:] = self._torques
        if len(self._drove):
            out[self._drove] += self._data.efc_force[self._rows : self._rows + len(self._drove)]
