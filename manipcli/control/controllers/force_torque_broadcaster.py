"""`force_torque_broadcaster`: publishes the wrench of a link on its parent, like a force/torque sensor between them.

    controllers:
      wrist_sensor:
        type: force_torque_broadcaster
        link: palm

The force [N] and the torque about the link's origin [N m] are those that the link, with all links below it, exerts on
its parent, in the link's frame (Gazebo's `child_to_parent`): a link that hangs at rest pulls with its weight. The log
has it as geometry_msgs/WrenchStamped in /NAME/wrench at every control tick; programs read
`manager["wrist_sensor"].wrench`. An engine without physics measures zeros. With `sensor: NAME` instead of `link` it
publishes what the sensor NAME of the robot or task measures.

The sensor measures weight, inertia and contact over the last physics step, including joint drives, mimic couplings, and
the noise of single steps. It does not measure the moment of `spinning_friction` or `rolling_friction` (0 unless given)
at a point of contact.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.control_loop import ControlLoop, NoLoop
from manipcli.control.controller import (
    BuildContext,
    ControllerMember,
    ControllerOutput,
    FeedForward,
    JointState,
    SensorRequest,
)
from manipcli.core.geometry import Array, frozen
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import ControllerSpec, Interface, Role


class ForceTorqueBroadcasterSpec(ControllerSpec):
    """Claims no joint; measures the wrench of a link on its parent, in the log as `/NAME/wrench`."""

    type: Literal["force_torque_broadcaster"] = Field(description="`force_torque_broadcaster`.")
    link: str | None = Field(
        None,
        description="Link whose wrench on its parent is measured, in this link's frame [N, N m]. Default: `frame_id`.",
    )
    sensor: str | None = Field(
        None,
        description="Name of a sensor `force_torque` of the robot or task, instead of `link`: it publishes what that "
        "one measures, with its noise and delay, in its frame. Default: the truth.",
    )
    frame_id: str | None = Field(
        None, description="ROS's name of the frame; if it is not a link and there is no `link`, it measures nothing."
    )


@dataclass(frozen=True, slots=True, eq=False)
class Wrench:
    """geometry_msgs/WrenchStamped, of the link on its parent, in the frame of `link`.

    Attributes:
        time: [s] of the update.
        link: the link, or the sensor.
        force: (3) [N].
        torque: (3) [N m] about the link's origin.
    """

    time: float
    link: str
    force: Array
    torque: Array


class ForceTorqueBroadcaster:
    """Publishes the reading of its sensor: `output.rows` (1, 6) are force and torque at the last update.

    Args:
        name: of the controller.
        link: in whose frame it measures; the name of the sensor with `sensor`.
        joint: between the link and its parent; fixed or not.
        sensor: the sensor of the robot or task that it publishes; "": the truth at the joint.
    """

    role: Role = "other"
    senses_contact = False
    joints: tuple[str, ...] = ()
    interfaces: tuple[Interface, ...] = ()
    feed_forward: FeedForward = "none"

    def __init__(self, *, name: str, link: str, joint: str = "", sensor: str = "") -> None:
        self.name = name
        self.link = link
        self.sensors = (SensorRequest(link, joint, sensor),)
        self.output = ControllerOutput.published(6)
        self._source = np.zeros(6)
        self._time = 0.0

    def attach(self, readings: Sequence[Array]) -> None:
        """Attach the reading (6) of its sensor: force and torque."""
        (self._source,) = readings

    @property
    def wrench(self) -> Wrench:
        """The wrench of the last update; zeros before the first."""
        values = self.output.rows[0]
        return Wrench(self._time, self.link, frozen(values[:3]), frozen(values[3:]))

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """No effect."""

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        """One control tick at `time` [s]."""
        self._time = time
        self.output.rows[0] = self._source
        return self.output


def build(name: str, spec: ForceTorqueBroadcasterSpec, context: BuildContext) -> ForceTorqueBroadcaster | None:
    """The controller of a spec; None if its `frame_id` is only a label."""
    if spec.sensor is not None:
        return ForceTorqueBroadcaster(name=name, link=spec.sensor, sensor=spec.sensor)
    link = spec.frame_id if spec.link is None else spec.link
    joint = next((joint.name for joint in context.robot.joints if joint.child == link), None)
    return None if link is None or joint is None else ForceTorqueBroadcaster(name=name, link=link, joint=joint)


def check(spec: ForceTorqueBroadcasterSpec, robot: RobotModel) -> Iterator[Problem]:
    """An unknown link, or the root; a `frame_id` that is only a label (a warning); joints, which it does not have."""
    if spec.joints:
        yield Problem(("joints",), "it reads no joints", "remove `joints`; `link` sets where it measures", "CTRL184")
    carried = [joint.child for joint in robot.joints]
    if spec.sensor is not None:
        if spec.link is not None:
            yield Problem(("link",), "it has both `link` and `sensor`", "remove one of them", "CTRL184")
        return
    if spec.link is None and spec.frame_id is None:
        yield Problem((), "it has no `link`", "add `link: ...`, the link at which it measures", "CTRL184")
    elif spec.link is None and spec.frame_id not in carried:
        message = f"frame_id '{spec.frame_id}' is not a link with a parent in robot '{robot.name}': left out"
        near = did_you_mean(str(spec.frame_id), carried, kind="links")
        yield Problem(("frame_id",), message, f"add `link: ...`; {near}", "CTRL184", "warning")
    elif spec.link is not None and spec.link not in carried:
        root = spec.link == robot.root
        message = "is the root and has no parent" if root else f"is not in robot '{robot.name}'"
        hint = did_you_mean(spec.link, carried, kind="links")
        yield Problem(("link",), f"link '{spec.link}' {message}", hint, "CTRL184")


def loop(spec: ForceTorqueBroadcasterSpec) -> ControlLoop:
    """No loop: it commands nothing."""
    return NoLoop("it commands nothing")


MEMBER = ControllerMember(
    name="force_torque_broadcaster", spec=ForceTorqueBroadcasterSpec, build=build, check=check, loop=loop
)
