"""`contact`: a switch on a link or body that is closed while it is touched with a force.

It measures the sum of the normal forces between the link and all that is not the robot; the switch is closed while the
measured force is at least `threshold`.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.conditions.sensed import Sensed
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.sensor import Quantity, SensorContext, SensorMember, Topic
from manipcli.simulate.touched import needs_a_part, touched_by
from manipcli.spec.base import Model
from manipcli.spec.mounted_sensor import MountedFilteredSpec
from manipcli.spec.quantity import Force
from manipcli.spec.sensors import ForceNoise, SensorNoise


class ContactNoise(SensorNoise):
    """Noise of the force, before it is compared."""

    force: ForceNoise = Field(ForceNoise(), description="Noise of the force [N].")


class ContactLimits(Model):
    """Measuring range."""

    force: Annotated[Force, Field(gt=0)] | None = Field(None, description="[N], above 0. Default: unlimited.")


class ContactSpec(MountedFilteredSpec):
    """A switch that a contact force closes."""

    type: Literal["contact"] = Field(description="`contact`.")
    threshold: Annotated[Force, Field(gt=0)] = Field(description="Force that closes it [N], above 0.")
    noise: ContactNoise = Field(ContactNoise(), description="Noise. Default: none.")
    limits: ContactLimits = Field(ContactLimits(), description="Measuring range. Default: unlimited.")


class Touched:
    """Reads (1) the sum of the normal forces on a link or body."""

    def __init__(self, spec: ContactSpec, context: SensorContext) -> None:
        self._engine, self._part = context.engine, context.place.part
        self._read = np.zeros(1)

    def read(self, state: WorldState) -> Array:
        self._read[0] = sum(contact.force for contact, _ in touched_by(self._engine, self._part))
        return self._read


def _quantities(spec: ContactSpec, robot: RobotModel) -> tuple[Quantity, ...]:
    most = np.inf if spec.limits.force is None else spec.limits.force
    return (Quantity("force", 1, spec.noise.force, 0.0, most),)


def _topics(spec: ContactSpec, robot: RobotModel) -> tuple[Topic, ...]:
    closed = partial(_closed, spec.threshold)
    fixed = {"threshold": spec.threshold}
    return (Topic("manipcli_msgs/msg/ContactSwitch", ("closed", "force"), derive=closed, constant=fixed),)


def _closed(threshold: float, force: Array) -> Array:
    return np.concatenate((force >= threshold, force), axis=1)


def _check(spec: ContactSpec, robot: RobotModel, scene: Scene) -> Iterator[Problem]:
    yield from needs_a_part(spec, scene)
    most = spec.limits.force
    if most is not None and most < spec.threshold:
        message = f"the switch never closes: its threshold of {spec.threshold:g} N is above the limit of {most:g} N"
        yield Problem(("threshold",), message, "raise `limits: {force: ...}`, or lower the threshold", "SENS109")


def _sensed(spec: ContactSpec, robot: RobotModel, scene: Scene) -> Sensed:
    most = {quantity.name: quantity.most for quantity in _quantities(spec, robot)}
    return Sensed("contact", fields=(("", "force", 1),), forces=1, threshold=spec.threshold, most=most)


MEMBER = SensorMember(
    name="contact", spec=ContactSpec, quantities=_quantities, topics=_topics, open=Touched, check=_check, sensed=_sensed
)
