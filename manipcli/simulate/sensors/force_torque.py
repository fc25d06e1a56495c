"""`force_torque`: a sensor between a link and its parent.

It measures the force [N] and the torque [N m] that the link, with all links below it, exerts on its parent, in the
sensor frame S and about its origin: a link that hangs at rest pulls with its weight.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.conditions.sensed import Sensed
from manipcli.core.geometry import Array
from manipcli.core.text import listed
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.sensor import Quantity, SensorContext, SensorMember, Topic, limited
from manipcli.spec.base import Model
from manipcli.spec.mounted_sensor import MountedFilteredSpec
from manipcli.spec.quantity import Force, Torque
from manipcli.spec.sensors import ForceNoise, SensorNoise, TorqueNoise


class ForceTorqueNoise(SensorNoise):
    """Noise of each axis."""

    force: ForceNoise = Field(ForceNoise(), description="Noise of the force [N].")
    torque: TorqueNoise = Field(TorqueNoise(), description="Noise of the torque [N m].")


class ForceTorqueLimits(Model):
    """Measuring range of each axis, in both directions."""

    force: Annotated[Force, Field(gt=0)] | None = Field(None, description="[N], above 0. Default: unlimited.")
    torque: Annotated[Torque, Field(gt=0)] | None = Field(None, description="[N m], above 0. Default: unlimited.")


class ForceTorqueSpec(MountedFilteredSpec):
    """Force and torque of a link, with all links below it, on its parent."""

    type: Literal["force_torque"] = Field(description="`force_torque`.")
    noise: ForceTorqueNoise = Field(ForceTorqueNoise(), description="Noise. Default: none.")
    limits: ForceTorqueLimits = Field(ForceTorqueLimits(), description="Measuring range. Default: unlimited.")


class ForceTorque:
    """Reads the wrench (6) that the engine measures at the joint above the link."""

    def __init__(self, spec: ForceTorqueSpec, context: SensorContext) -> None:
        X_LS = context.place.X_PS
        joint = next(joint for joint in context.robot.joints if joint.child == spec.link)
        self._wrench = context.engine.sense_wrench(joint.name)
        # f_S = R' f_L, t_S = R' (t_L - p x f_L)
        x, y, z = X_LS.p.tolist()
        crossed = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        R = np.asarray(X_LS.R).T
        self._to_S = np.block([[R, np.zeros((3, 3))], [-R @ crossed, R]])
        self._same = bool((self._to_S == np.eye(6)).all())
        self._read = np.zeros(6)

    def read(self, state: WorldState) -> Array:
        return self._wrench if self._same else np.matmul(self._to_S, self._wrench, out=self._read)


def _quantities(spec: ForceTorqueSpec, robot: RobotModel) -> tuple[Quantity, ...]:
    noise, limits = spec.noise, spec.limits
    return limited("force", 3, noise.force, limits.force), limited("torque", 3, noise.torque, limits.torque)


def _check(spec: ForceTorqueSpec, robot: RobotModel, scene: Scene) -> Iterator[Problem]:
    if spec.link == robot.root:
        carried = [joint.child for joint in robot.joints]
        hint = f"choose a link that another one carries: {listed(carried)}"
        yield Problem(("link",), f"link '{spec.link}' is the root and has no parent to press on", hint, "SENS103")


def _sensed(spec: ForceTorqueSpec, robot: RobotModel, scene: Scene) -> Sensed:
    most = {quantity.name: quantity.most for quantity in _quantities(spec, robot)}
    return Sensed("force_torque", fields=(("", "wrench", 6),), most=most)


MEMBER = SensorMember(
    name="force_torque",
    spec=ForceTorqueSpec,
    quantities=_quantities,
    topics=lambda spec, robot: (Topic("geometry_msgs/msg/WrenchStamped", ("wrench",)),),
    open=ForceTorque,
    check=_check,
    needs_link=True,
    sensed=_sensed,
)
