"""`imu`: angular velocity and linear acceleration of a place, in the sensor frame S.

The linear acceleration is that of S less gravity, as an accelerometer measures it: at rest it is 9.81 m/s^2 upwards, in
free fall 0. Accelerations of joints and bodies are the mean over the last control tick. There is no orientation.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Array, matrix_from_quat
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.simulate.link_motion import PlaceMotion
from manipcli.simulate.sensor import Probe, Quantity, SensorContext, SensorMember, Topic, limited
from manipcli.spec.base import Model
from manipcli.spec.mounted_sensor import MountedFilteredSpec
from manipcli.spec.quantity import Acceleration
from manipcli.spec.sensors import AccelerationNoise, AngularVelocity, AngularVelocityNoise, SensorNoise


class ImuNoise(SensorNoise):
    """Noise of each axis."""

    angular_velocity: AngularVelocityNoise = Field(
        AngularVelocityNoise(), description="Noise of the angular velocity [rad/s]."
    )
    linear_acceleration: AccelerationNoise = Field(
        AccelerationNoise(), description="Noise of the linear acceleration [m/s^2]."
    )


class ImuLimits(Model):
    """Measuring range of each axis, in both directions."""

    angular_velocity: Annotated[AngularVelocity, Field(gt=0)] | None = Field(
        None, description="[rad/s], above 0. Default: unlimited."
    )
    linear_acceleration: Annotated[Acceleration, Field(gt=0)] | None = Field(
        None, description="[m/s^2], above 0. Default: unlimited."
    )


class ImuSpec(MountedFilteredSpec):
    """Angular velocity, and linear acceleration less gravity."""

    type: Literal["imu"] = Field(description="`imu`.")
    noise: ImuNoise = Field(ImuNoise(), description="Noise. Default: none.")
    limits: ImuLimits = Field(ImuLimits(), description="Measuring range. Default: unlimited.")


class OnLink:
    """An IMU on a link, by the kinematics of the robot."""

    def __init__(self, context: SensorContext) -> None:
        self._context = context
        self._motion: PlaceMotion | None = None
        self._joints: Array | None = None

    def read(self, state: WorldState) -> Array:
        if self._motion is None or state.position is not self._joints:
            self._joints = state.position
            context, mount = self._context, self._context.place
            self._motion = PlaceMotion(
                context.robot, mount.parent, mount.X_PS, context.scene.gravity, context.period, state.position,
                state.velocity, context.before.velocity,
            )  # fmt: skip
        self._motion.measure()
        return self._motion.measured


class OnBody:
    """An IMU on a body of the scene, or fixed in the world."""

    def __init__(self, context: SensorContext) -> None:
        self._mount = mount = context.place
        self._before = context.before
        self._period = context.period
        self._gravity = np.asarray(context.scene.gravity)
        self._p, self._R = np.asarray(mount.X_PS.p), np.asarray(mount.X_PS.R)
        self._read = np.zeros(6)

    def read(self, state: WorldState) -> Array:
        k = self._mount.movable
        if k < 0:
            self._read[3:] = self._mount.pose(state).R.T @ -self._gravity
            return self._read
        R_WO = matrix_from_quat(state.body_quat_xyzw[k])
        angular, before = state.body_angular[k], self._before
        linear_acceleration = (state.body_linear[k] - before.body_linear[k]) / self._period
        angular_acceleration = (angular - before.body_angular[k]) / self._period
        arm = R_WO @ self._p
        swing = np.cross(angular_acceleration, arm) + np.cross(angular, np.cross(angular, arm))
        R_SW = (R_WO @ self._R).T
        self._read[:3] = R_SW @ angular
        self._read[3:] = R_SW @ (linear_acceleration + swing - self._gravity)
        return self._read


def _open(spec: ImuSpec, context: SensorContext) -> Probe:
    return OnLink(context) if context.place.on_link else OnBody(context)


def _quantities(spec: ImuSpec, robot: RobotModel) -> tuple[Quantity, ...]:
    noise, limits = spec.noise, spec.limits
    return (
        limited("angular_velocity", 3, noise.angular_velocity, limits.angular_velocity),
        limited("linear_acceleration", 3, noise.linear_acceleration, limits.linear_acceleration),
    )


def _topics(spec: ImuSpec, robot: RobotModel) -> tuple[Topic, ...]:
    """Covariances of the white noise; -1 says that there is no orientation."""
    variances = {
        f"{quantity.name}_covariance": quantity.noise.white**2 * np.eye(3) for quantity in _quantities(spec, robot)
    }
    none = np.array([-1.0, *np.zeros(8)])
    filled = ("angular_velocity", "linear_acceleration")
    return (Topic("sensor_msgs/msg/Imu", filled, {"orientation_covariance": none, **variances}),)


MEMBER = SensorMember(name="imu", spec=ImuSpec, quantities=_quantities, topics=_topics, open=_open, remembers=True)
