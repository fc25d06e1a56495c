"""Mimic joints in MuJoCo: equality constraints, made exact after each physics step."""

from __future__ import annotations

from typing import Any

import numpy as np

from manipcli.model.robot import RobotModel


class Mimics:
    """The mimic joints of one robot, whose joints are the first n degrees of freedom of `data`.

    The constraint couples the efforts of driver and mimic joint, so that each feels the other's load. It is slightly
    soft, which leaves the mimic joint up to some 1e-6 rad off.
    """

    def __init__(self, data: Any, robot: RobotModel) -> None:
        n = len(robot.joint_names)
        self._position, self._velocity = data.qpos[:n], data.qvel[:n]
        moving = enumerate(robot.moving_joints)
        mimics = [(k, joint.mimic) for k, joint in moving if joint.mimic is not None and joint.mimic.curve is None]
        self._followers = np.array([k for k, _ in mimics], dtype=np.intp)
        self._drivers = np.array([robot.joint_names.index(mimic.joint) for _, mimic in mimics], dtype=np.intp)
        self._multipliers = np.array([mimic.multiplier for _, mimic in mimics])
        self._offsets = np.array([mimic.offset for _, mimic in mimics])

    def __bool__(self) -> bool:
        return len(self._followers) > 0

    def follow(self) -> None:
        """Set positions and velocities of the mimic joints from their drivers."""
        position, velocity = self._position, self._velocity
        position[self._followers] = self._multipliers * position[self._drivers] + self._offsets
        velocity[self._followers] = self._multipliers * velocity[self._drivers]
