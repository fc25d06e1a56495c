"""The felt force: what the tool exerts on what it touches, from the efforts of the joints or a force/torque sensor.

Without a sensor it is estimated by a momentum observer. With the generalised momentum p = M(q) v of the arm,

    r = k (p - int (tau + C(q, v)^T v - g(q) - D v + r) dt),

so that r' = k (tau_ext - r): r follows the effort of external forces as a first-order filter. The
wrench of the tool is f = -(J J^T + s^2)^-1 J r, in the axes of the tool frame. De Luca and Mattone, Actuator failure
detection and isolation using generalized momenta (2003); Haddadin, De Luca, Albu-Schaeffer, Robot collisions: a survey
(2017), section IV. Source of tau: the measured efforts. Everything that touches the arm is attributed to the tool.

A `tare` sets what is felt now, over 0.1 s, to zero: the weight of what is held, and errors of the model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.control.controller import ControllerOutput, FeedForward, JointState, SensorRequest
from manipcli.core.geometry import Array, Transform, cross
from manipcli.model.kinematics import Kinematics
from manipcli.spec.controllers import Interface, Role

BANDWIDTH: Final = 25.0
"""[Hz] Of the observer."""
TARING: Final = 0.1
"""[s] For which what is felt is averaged."""
SINGULAR: Final = 1e-3
"""s: tool directions in which the joints move less than this [m or rad per rad] are not felt."""


class FeltForce:
    """Publishes the wrench that the tool exerts, (6): force [N] and torque about the tool [N m], in the tool's axes.

    Args:
        name: of the controller; the topic is /NAME/wrench.
        kinematics: of the robot.
        arm: the joints that move the tool.
        link, offset: the tool frame T is at `offset` X_LT in the link.
        sensor: a sensor `force_torque` between arm and tool, instead of the observer; "": none.
        X_ST: the tool frame in the frame of the sensor.
    """

    role: Role = "other"
    senses_contact = False
    interfaces: tuple[Interface, ...] = ()
    feed_forward: FeedForward = "none"

    def __init__(
        self,
        *,
        name: str,
        kinematics: Kinematics,
        arm: Sequence[str],
        link: str,
        offset: Transform | None = None,
        sensor: str = "",
        X_ST: Transform | None = None,
    ) -> None:
        robot = kinematics.robot
        self.name, self.frame = name, link
        self.joints = robot.joint_names
        self.sensors = (SensorRequest(sensor, sensor=sensor),) if sensor else ()
        self.arriving = np.ones(7)
        """Whether it was updated at this tick, always 1, and the wrench."""
        published = ControllerOutput.published(6)
        self.output = replace(published, rows=self.arriving[None, 1:])
        self._kinematics, self._link, self._offset = kinematics, link, offset
        self._columns = robot.indices(tuple(arm))
        self._damping = np.array([joint.damping for joint in robot.moving_joints])[self._columns]
        self._reading = np.zeros(6)
        self._X_TS = None if X_ST is None else X_ST.inverse()
        self._begun = False
        self._start, self._sum, self._residual = np.zeros((3, len(self._columns)))
        self._bias, self._total = np.zeros(6), np.zeros(6)
        self._taring, self._count = 0.0, 0

    def attach(self, readings: Sequence[Array]) -> None:
        """Attach the reading (6) of its sensor."""
        (self._reading,) = readings

    @property
    def wrench(self) -> Array:
        """(6) as of the last update; a view."""
        wrench: Array = self.output.rows[0]
        return wrench

    @property
    def taring(self) -> bool:
        """Whether it is still averaging what it will feel as zero."""
        return self._taring > 0.0

    def tare(self) -> None:
        """Feel the mean of the next `TARING` seconds as zero."""
        self._taring, self._count = TARING, 0
        self._total[:] = 0.0

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Start again at the next update."""
        self._begun = False

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        """One control tick at `time` [s]."""
        raw = self._sensed() if self.sensors else self._observed(period, measured)
        if self._taring > 0.0:
            self._total += raw
            self._count += 1
            self._taring -= period
            self._bias = self._total / self._count
        self.output.rows[0] = raw - self._bias
        return self.output

    def _sensed(self) -> Array:
        """What the sensor measures is the wrench of the tool on the arm: the opposite, about the tool."""
        force, torque = -self._reading[:3], -self._reading[3:]
        X = self._X_TS
        if X is None:
            return np.concatenate([force, torque])
        turned = X.R @ force
        return np.concatenate([turned, X.R @ torque + cross(X.p, turned)])

    def _observed(self, period: float, measured: JointState) -> Array:
        columns, q, v = self._columns, measured.position, measured.velocity
        momentum, rate = self._kinematics.momentum(q, v)
        p = momentum[columns]
        if not self._begun:
            self._begun = True
            self._start, self._sum[:], self._residual[:] = p, 0.0, 0.0
        else:
            known = measured.effort[columns] + rate[columns] - self._damping * v[columns]
            self._sum += (known + self._residual) * period
            self._residual = math.tau * BANDWIDTH * (p - self._start - self._sum)
        R, _, J = self._kinematics.pose_and_jacobian(q, self._link, self._offset)
        J = J[:, columns]
        wrench = -np.linalg.solve(J @ J.T + SINGULAR**2 * np.eye(6), J @ self._residual)
        return (wrench.reshape(2, 3) @ R).reshape(6)
