"""Wrenches at joints of PyBullet's robot.

Bullet tells what a joint's parent puts on its child: along the axes of the child's inertial frame C, about the centre
of mass, and without what a motor puts along (a force through the centre of mass) or about the axis of the joint. From
it the wrench of the child on the parent, in the child's frame L, about its origin:

    f_L = -R_LC f_C        m_L = -(R_LC m_C + p_LC x R_LC f_C)        and the same of the motor's
"""

from __future__ import annotations

from types import ModuleType

import numpy as np

from manipcli.core.geometry import Array, cross, matrix_from_quat
from manipcli.model.robot import Joint


class WrenchSensor:
    """Measures at one joint.

    Args:
        p: PyBullet.
        client: its world.
        body: Bullet's number of the robot.
        index: Bullet's number of the joint.
        joint: the joint.

    Attributes:
        values: (6) force [N] and torque [N m] of the child on the parent at the last measurement.
    """

    def __init__(self, p: ModuleType, client: int, body: int, index: int, joint: Joint) -> None:
        self._p, self._client, self._body, self._index = p, client, body, index
        p.enableJointForceTorqueSensor(body, index, True, physicsClientId=client)
        inertial = p.getDynamicsInfo(body, index, physicsClientId=client)
        p_LC, R_LC = np.array(inertial[3]), matrix_from_quat(inertial[4])
        arm = np.array([cross(p_LC, column) for column in R_LC.T]).T
        self._map = -np.block([[R_LC, np.zeros((3, 3))], [arm, R_LC]])
        axis, none = -joint.axis, np.zeros(3)
        slides = joint.type == "prismatic"
        self._motor = np.concatenate([axis, cross(p_LC, axis)] if slides else [none, axis])
        self._driven = joint.moves
        self.values: Array = np.zeros(6)

    def measure(self) -> None:
        """What the last physics step came to."""
        _, _, reaction, motor = self._p.getJointState(self._body, self._index, self._client)
        np.matmul(self._map, reaction, out=self.values)
        if self._driven:
            self.values += motor * self._motor
