"""`forward_command`: controller that forwards positions, velocities or efforts to the joints.

    controllers:
      arm_controller:
        type: forward_command
        joints: [joint_1, joint_2]
        command_interface: velocity

Steps cannot use it; it is for Python programs:

    manager["arm_controller"].set_command([0.1, 0.0])  # rad/s, from the next update on

Until the first command it holds: the measured position, zero velocity, zero effort.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.control_loop import ControlLoop, NoLoop
from manipcli.control.controller import (
    BuildContext,
    ControllerMember,
    ControllerOutput,
    FeedForward,
    JointState,
    distinct,
)
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import ChainableSpec, Interface, Role


class ForwardCommandSpec(ChainableSpec):
    """Forwards the values of `set_command`; until then it holds: the measured position, zero velocity, zero effort."""

    type: Literal["forward_command"] = Field(description="`forward_command`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interface: Literal["position", "velocity", "effort"] = Field(description="What it commands.")
    gravity_compensation: bool = Field(
        False, description="Add the effort that compensates gravity, to efforts. Default false."
    )

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return (self.command_interface,)


class ForwardCommandController:
    """Forwards the values of `set_command` on one interface.

    Its reference is the commanded position; with velocities, the commanded velocity and the position one period ahead;
    with efforts, the measured state.

    Args:
        name: of the controller.
        joints: (n) distinct names.
        interface: of the commands.
        feed_forward: added to efforts.
        chained_to: the controller whose references it commands; None: it commands the joints.

    Raises:
        InvalidArgument: no or duplicate joints.
    """

    role: Role = "other"
    senses_contact = False
    sensors = ()

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        interface: Interface,
        feed_forward: FeedForward = "none",
        chained_to: str | None = None,
    ) -> None:
        self.name, self.chained_to = name, chained_to
        self.joints = distinct(name, joints)
        self.interfaces: tuple[Interface, ...] = (interface,)
        self.feed_forward: FeedForward = feed_forward
        n = len(self.joints)
        self._interface = interface
        self.output = ControllerOutput.of(n, 1)
        self._wanted = np.zeros(n)
        self._commanded = False

    def set_command(self, values: npt.ArrayLike) -> None:
        """Set the command from the next update on, until deactivation.

        Args:
            values: (n) rad, rad/s or N m; m, m/s or N.

        Raises:
            InvalidArgument: not one finite number per joint; the previous command is kept.
        """
        self._wanted = finite_values(self.name, self.joints, values)
        self._commanded = True

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Clear the command; the next update holds."""
        self._commanded = False

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        """One control tick at `time` [s] of the length `period` [s]; `contact_force` is ignored."""
        output, command = self.output, self.output.command
        if not self._commanded:
            self._commanded = True
            self._wanted = np.array(measured.position) if self._interface == "position" else np.zeros(len(self.joints))
        command[:] = self._wanted
        if self._interface == "position":
            output.position[:] = command
        elif self._interface == "velocity":
            output.velocity[:] = command
            np.multiply(command, period, out=output.position)
            np.add(output.position, measured.position, out=output.position)
        else:
            output.position[:] = measured.position
            output.velocity[:] = measured.velocity
        return output


def finite_values(name: str, joints: Sequence[str], values: npt.ArrayLike) -> Array:
    """(n) a copy of finite numbers, one per joint.

    Raises:
        InvalidArgument: they are not.
    """
    given = np.array(values, dtype=np.float64)
    if given.shape != (len(joints),):
        message = f"controller '{name}': values of shape {given.shape}; expected {len(joints)}, one per joint"
        raise InvalidArgument("CTRL181", message, hint=f"joints: {', '.join(joints)}")
    bad = np.flatnonzero(~np.isfinite(given))
    if len(bad):
        message = f"controller '{name}': {given[bad[0]]} for joint '{joints[bad[0]]}'; expected a finite number"
        raise InvalidArgument("CTRL181", message)
    return given


def build(name: str, spec: ForwardCommandSpec, context: BuildContext) -> ForwardCommandController:
    """The controller of a spec."""
    wants: FeedForward = "gravity" if spec.gravity_compensation else "none"
    return ForwardCommandController(
        name=name, joints=spec.joints, interface=spec.command_interface, feed_forward=wants, chained_to=spec.chained_to
    )


def check(spec: ForwardCommandSpec, robot: RobotModel) -> Iterator[Problem]:
    """Gravity compensation without an effort command."""
    if spec.gravity_compensation and spec.command_interface != "effort":
        message = f"gravity_compensation needs the effort interface, not {spec.command_interface}"
        yield Problem(
            ("gravity_compensation",),
            message,
            "use command_interface: effort, or remove gravity_compensation",
            "CTRL147",
        )


def loop(spec: ForwardCommandSpec) -> ControlLoop:
    """No loop: a program closes it."""
    return NoLoop("it forwards commands and has no gains")


MEMBER = ControllerMember(name="forward_command", spec=ForwardCommandSpec, build=build, check=check, loop=loop)
