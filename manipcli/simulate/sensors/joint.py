"""`joint`: encoders and torque sensors of joints. Controllers get what it measures instead of the truth."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.core.geometry import Array
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.sensor import Quantity, SensorContext, SensorMember, Topic, limited
from manipcli.spec.base import Model
from manipcli.spec.mounted_sensor import FilteredSpec
from manipcli.spec.names import JointName
from manipcli.spec.quantity import JointEffort, JointVelocity
from manipcli.spec.sensors import EffortNoise, PositionNoise, SensorNoise, VelocityNoise


class JointNoise(SensorNoise):
    """Noise of each joint."""

    position: PositionNoise = Field(PositionNoise(), description="Noise of positions [rad or m].")
    velocity: VelocityNoise = Field(VelocityNoise(), description="Noise of velocities [rad/s or m/s].")
    effort: EffortNoise = Field(EffortNoise(), description="Noise of efforts [N m or N].")


class JointLimits(Model):
    """Measuring range of each joint, in both directions."""

    velocity: Annotated[JointVelocity, Field(gt=0)] | None = Field(
        None, description="[rad/s or m/s], above 0. Default: unlimited."
    )
    effort: Annotated[JointEffort, Field(gt=0)] | None = Field(
        None, description="[N m or N], above 0. Default: unlimited."
    )


class JointSpec(FilteredSpec):
    """Positions, velocities and efforts of joints; controllers get what it measures."""

    type: Literal["joint"] = Field(description="`joint`.")
    joints: tuple[JointName, ...] | None = Field(None, description="The joints. Default: all that move.", min_length=1)
    noise: JointNoise = Field(JointNoise(), description="Noise. Default: none.")
    limits: JointLimits = Field(JointLimits(), description="Measuring range. Default: unlimited.")


def joints_of(spec: JointSpec, robot: RobotModel) -> tuple[str, ...]:
    """The joints that it measures."""
    return robot.joint_names if spec.joints is None else spec.joints


class Joints:
    """Reads (3 n): positions, velocities, then efforts."""

    def __init__(self, spec: JointSpec, context: SensorContext) -> None:
        n = len(context.robot.joint_names)
        joints = np.array(context.robot.indices(joints_of(spec, context.robot)), dtype=np.intp)
        self._index = np.concatenate((joints, joints + n, joints + 2 * n))
        self._whole = len(self._index) == 3 * n and bool((self._index == np.arange(3 * n)).all())
        self._end = 3 * n
        self._read = np.zeros(len(self._index))

    def read(self, state: WorldState) -> Array:
        numbers = state.numbers[: self._end]  # positions, velocities, efforts
        if self._whole:
            return numbers
        self._read[:] = numbers[self._index]
        return self._read


def _quantities(spec: JointSpec, robot: RobotModel) -> tuple[Quantity, ...]:
    n, noise, limits = len(joints_of(spec, robot)), spec.noise, spec.limits
    return (
        Quantity("position", n, noise.position),
        limited("velocity", n, noise.velocity, limits.velocity),
        limited("effort", n, noise.effort, limits.effort),
    )


def _topics(spec: JointSpec, robot: RobotModel) -> tuple[Topic, ...]:
    names = joints_of(spec, robot)
    filled = ("position", "velocity", "effort")
    return (Topic("sensor_msgs/msg/JointState", filled, {"name": names} | dict.fromkeys(filled, np.zeros(len(names)))),)


def _check(spec: JointSpec, robot: RobotModel, scene: Scene) -> Iterator[Problem]:
    for k, name in enumerate(spec.joints or ()):
        if name not in robot.joint_names:
            message = f"robot '{robot.name}' has no joint '{name}' that moves"
            yield Problem(("joints", k), message, did_you_mean(name, robot.joint_names, kind="joints"), "SENS105")
        elif name in (spec.joints or ())[:k]:
            yield Problem(("joints", k), f"duplicate joint '{name}'", "name it once", "SENS105")


MEMBER = SensorMember(
    name="joint",
    spec=JointSpec,
    quantities=_quantities,
    topics=_topics,
    open=Joints,
    check=_check,
    joints=joints_of,
)
