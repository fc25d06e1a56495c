"""`joint_state_broadcaster`: offers measured joint states to Python; claims and commands no joint.

    controllers:
      joint_state_broadcaster:
        type: joint_state_broadcaster
        joints: [joint_1, joint_2]
        state_interfaces: [position, velocity]

The log always has all joints in /joint_states. This controller is for files that name it, and for programs that read
some joints at their own rate: `manager["joint_state_broadcaster"].state`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.control_loop import ControlLoop, NoLoop
from manipcli.control.controller import BuildContext, ControllerMember, ControllerOutput, FeedForward, JointState
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array, frozen
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import ControllerSpec, Interface, Role


class JointStateBroadcasterSpec(ControllerSpec):
    """Claims no joint; offers measured joint states to Python. The log always has all joints in /joint_states."""

    type: Literal["joint_state_broadcaster"] = Field(description="`joint_state_broadcaster`.")
    joints: tuple[str, ...] = Field((), description="The joints that it reads. Default: all moving joints.")
    state_interfaces: Annotated[
        tuple[Literal["position", "velocity", "effort"], ...],
        Field(min_length=1, description="Measured values. Default [position, velocity, effort]."),
    ] = ("position", "velocity", "effort")


@dataclass(frozen=True, slots=True, eq=False)
class BroadcastState:
    """sensor_msgs/JointState: (n) copies in the order of `names`; empty arrays for what is not broadcast.

    Attributes:
        time: [s] of the update.
        names: (n) of the joints.
        position, velocity, effort: rad or m, per second, N m or N.
    """

    time: float
    names: tuple[str, ...]
    position: Array
    velocity: Array
    effort: Array


class JointStateBroadcaster:
    """Keeps the measured state of its last update.

    Args:
        name: of the controller.
        joints: (n) distinct names.
        state_interfaces: the measured values to keep.

    Raises:
        InvalidArgument: duplicate joints, or an interface that is not measured.
    """

    role: Role = "other"
    senses_contact = False
    sensors = ()
    interfaces: tuple[Interface, ...] = ()
    feed_forward: FeedForward = "none"

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        state_interfaces: Sequence[Interface] = ("position", "velocity", "effort"),
    ) -> None:
        self.name = name
        self.joints = tuple(joints)
        if len(set(self.joints)) != len(self.joints):
            raise InvalidArgument("CTRL101", f"controller '{name}': its joints must be distinct")
        if not {*state_interfaces} <= {"position", "velocity", "effort"}:
            raise InvalidArgument("CTRL183", f"controller '{name}': {list(state_interfaces)} are not all measured")
        self._wanted = tuple(word in state_interfaces for word in ("position", "velocity", "effort"))
        self.output = ControllerOutput.published(0)
        self._seen = np.zeros((3, len(self.joints)))
        self._time = 0.0

    @property
    def state(self) -> BroadcastState:
        """The state at the last update; zeros before the first."""
        rows = [frozen(row) if wanted else frozen([]) for row, wanted in zip(self._seen, self._wanted, strict=True)]
        return BroadcastState(self._time, self.joints, *rows)

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """No effect."""

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        """One control tick at `time` [s]."""
        seen, self._time = self._seen, time
        seen[0], seen[1], seen[2] = measured.position, measured.velocity, measured.effort
        return self.output


def build(name: str, spec: JointStateBroadcasterSpec, context: BuildContext) -> JointStateBroadcaster:
    """The controller of a spec."""
    joints = spec.joints or context.robot.joint_names
    return JointStateBroadcaster(name=name, joints=joints, state_interfaces=spec.state_interfaces)


def check(spec: JointStateBroadcasterSpec, robot: RobotModel) -> Iterator[Problem]:
    """Nothing: the joints are checked for every controller."""
    return iter(())


def loop(spec: JointStateBroadcasterSpec) -> ControlLoop:
    """No loop: it commands nothing."""
    return NoLoop("it commands nothing")


MEMBER = ControllerMember(
    name="joint_state_broadcaster", spec=JointStateBroadcasterSpec, build=build, check=check, loop=loop
)
