"""`pid`: controller with one PID per joint.

    controllers:
      wrist_controller:
        type: pid
        joints: [joint_6, joint_7]
        command_interface: effort
        reference_and_state_interfaces: [position, velocity]
        gains: {joint_6: {p: 80, i: 20, d: 3, i_clamp: 5}, joint_7: {p: 30, d: 0.4, feedforward_gain: 0.1}}

Steps cannot use it, unless a trajectory controller is `chained_to` it; it is for Python programs:

    manager["wrist_controller"].set_reference([0.3, -0.2])

u = ff r + PID(r - x, d/dt). With one interface, r is its reference, and the PID computes the derivative of the error:
(e - last e) / period, from 0 at first. With two, the error of the second interface is the derivative, and ff applies to
the second reference: u = ff r' + PID(r - x, r' - x'). On the position interface u is a position, as in ROS 2; without
a reference it is the measured one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.control_loop import ControlLoop, NoLoop, PidLoop
from manipcli.control.controller import (
    BuildContext,
    ControllerMember,
    ControllerOutput,
    FeedForward,
    JointState,
    distinct,
    refuse_not_finite,
)
from manipcli.control.controllers.forward_command import finite_values
from manipcli.control.gains import build_pid, gains_of, own_joints, strangers, tune_pid
from manipcli.control.tunable_gains import TunableGains
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.description.elements import JointType
from manipcli.description.transmission import Compat
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import ChainableSpec, GainsSpec, Interface, Role


class PidGainsSpec(GainsSpec):
    """PID gains of one joint of a `pid` controller."""

    feedforward_gain: float = Field(
        0.0, description="Factor of the added reference (of its derivative, with two interfaces). Default 0."
    )
    angle_wraparound: bool | None = Field(
        None, description="The position error is the shortest angle. Default: for continuous joints."
    )
    save_i_term: bool = Field(True, description="Keep the integral term while it is not active. Default true.")


class PidSpec(ChainableSpec):
    """Controls each joint with its own PID; `set_reference` sets the references."""

    type: Literal["pid"] = Field(description="`pid`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interface: Literal["position", "velocity", "effort"] = Field(
        "effort", description="What it commands. Default effort."
    )
    reference_and_state_interfaces: Annotated[
        tuple[Literal["position", "velocity"], ...],
        Field(
            min_length=1,
            max_length=2,
            description="Controlled values: [position], [position, velocity], or [velocity].",
        ),
    ] = ("position",)
    gains: dict[str, PidGainsSpec] = Field(description="PID gains by joint.")
    gravity_compensation: bool = Field(
        False, description="Add the effort that compensates gravity, to efforts. Default false."
    )
    set_current_state_as_first_setpoint: bool = Field(
        True, description="Hold the measured state until a reference is set; otherwise command 0. Default true."
    )

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return (self.command_interface,)

    @property
    def references(self) -> tuple[Interface, ...]:
        """Its references, which another controller may command."""
        return self.reference_and_state_interfaces


class PidController:
    """ROS 2's `pid_controller/PidController`.

    Args:
        name: of the controller.
        joints: (n) distinct names.
        gains: by joint name, a `PidGainsSpec` or its fields.
        interface: of the command.
        led: controlled values: position, position and velocity, or velocity.
        types: (n) joint types: the position error of a `continuous` joint is the shortest angle by default.
        hold_first: hold the state at activation until a reference is set; otherwise command 0 until then.
        feed_forward: added to efforts.
        compat: order of the PID integration.
        chained_to: the controller whose references it commands; None: it commands the joints.

    Attributes:
        gains: may change.

    Raises:
        InvalidArgument: no or duplicate joints; gains that are missing, invalid, zero or of other joints; other `led`.
    """

    role: Role = "other"
    senses_contact = False
    sensors = ()

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        gains: Mapping[str, PidGainsSpec | Mapping[str, float]],
        interface: Interface = "effort",
        led: Sequence[Interface] = ("position",),
        types: Sequence[JointType] | None = None,
        hold_first: bool = True,
        feed_forward: FeedForward = "none",
        compat: Compat | None = None,
        chained_to: str | None = None,
    ) -> None:
        self.name, self.chained_to = name, chained_to
        self.references: tuple[Interface, ...] = tuple(led)
        self._sources: list[tuple[Array, Array]] = []
        self.joints = distinct(name, joints)
        self.interfaces: tuple[Interface, ...] = (interface,)
        self.feed_forward: FeedForward = feed_forward
        n = len(self.joints)
        if tuple(led) not in (("position",), ("position", "velocity"), ("velocity",)):
            raise InvalidArgument("CTRL182", f"controller '{name}': {list(led)} cannot be controlled together")
        for joint in {*gains} ^ {*self.joints}:
            kind = "has gains, but is not a joint of the controller" if joint in gains else "has no gains"
            raise InvalidArgument("CTRL102", f"controller '{name}': '{joint}' {kind}")
        own = tuple(gains_of(name, joint, gains[joint], PidGainsSpec) for joint in self.joints)
        self._pid = build_pid(name, self.joints, _counted(own), compat)
        self.gains = TunableGains(name, self.joints, own, self._tune)
        self._forward = np.array([g.feedforward_gain for g in own])
        self._saves = np.array([g.save_i_term for g in own])
        if self._saves.any() != self._saves.all():
            raise InvalidArgument("CTRL182", f"controller '{name}': save_i_term differs between its joints")
        endless = [kind == "continuous" for kind in types] if types is not None else [False] * n
        self._wraps = np.array(
            [led[0] == "position" and (e if g.angle_wraparound is None else g.angle_wraparound)
             for g, e in zip(own, endless, strict=True)], dtype=np.float64,
        )  # fmt: skip
        self._has_wraps = bool(self._wraps.any())
        self._led_velocity = led[0] == "velocity"
        self._given_rates = len(led) == 2
        self._hold_first = hold_first

        self.output = ControllerOutput.of(n, 1)
        self._errors = np.zeros((2, n))
        self._error, self._error_rate = self._errors
        self._all_errors = self._errors.reshape(-1)
        self._fed, self._before = np.zeros((2, n))
        # ROS 1 has no derivative before the second error.
        self._first_rate = compat != "ros1"
        self._has_before = False
        self._reference, self._rate = np.zeros((2, n))
        self._has_reference = self._activated = False

    def _tune(self, gains: tuple[GainsSpec, ...]) -> None:
        counted = _counted(gains)
        tune_pid(self._pid, self.name, self.joints, counted)
        self._forward[:] = [g.ff_velocity_scale for g in counted]

    def set_reference(self, values: npt.ArrayLike, rates: npt.ArrayLike | None = None) -> None:
        """Set the reference from the next update on, until deactivation.

        Args:
            values: (n) rad or m; for velocities, rad/s or m/s.
            rates: (n) rad/s or m/s, only with both positions and velocities; 0 by default.

        Raises:
            InvalidArgument: not one finite number per joint, or rates without the velocity interface.
        """
        if rates is not None and not self._given_rates:
            message = f"controller '{self.name}' does not control a second interface"
            raise InvalidArgument("CTRL182", message, hint="set reference_and_state_interfaces: [position, velocity]")
        if self._sources:
            message = f"controller '{self.name}': another controller commands its references"
            raise InvalidArgument("CTRL182", message, hint="deactivate that one, or send it a goal")
        reference = finite_values(self.name, self.joints, values)
        self._rate = np.zeros(len(self.joints)) if rates is None else finite_values(self.name, self.joints, rates)
        self._reference = reference
        self._has_reference = True

    def chain(self, sources: Mapping[Interface, Array] | None, order: npt.ArrayLike = ()) -> None:
        """Follow these live arrays (n) from the next update on, by interface; None: hold the last reference.

        Args:
            sources: commands of the preceding controller.
            order: (n) index of each joint in them.
        """
        self._order = np.array(order, dtype=np.intp)
        self._sources = []
        if sources is not None:
            self._reference, self._rate = np.array(self._reference), np.zeros(len(self.joints))
            targets = dict(zip(self.references, (self._reference, self._rate), strict=False))
            self._sources = [(targets[interface], source) for interface, source in sources.items()]

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Clear its reference, and the integral unless that is saved."""
        self._has_reference = self._activated = False

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        """One control tick at `time` [s] of the length `period` [s]; `contact_force` is ignored."""
        output = self.output
        state = measured.velocity if self._led_velocity else measured.position
        if not self._activated:
            self._activated = True
            self._pid.reset(keep_integral=bool(self._saves.all()))
            self._before[:] = 0.0
            self._has_before = self._first_rate
            if self._sources:
                self._has_reference = True
            if not self._has_reference and self._hold_first:
                self._has_reference = True
                self._reference, self._rate = np.array(state), np.zeros(len(self.joints))
        for target, source in self._sources:
            target[:] = source[self._order]
        if not self._has_reference:
            output.rows[:] = 0.0
            output.position[:] = measured.position
            if self.interfaces == ("position",):
                output.command[:] = measured.position
            return output
        error = np.subtract(self._reference, state, out=self._error)
        if self._has_wraps:
            turns = np.maximum(np.ceil(np.abs(error) / math.tau - 0.5), 0.0)
            error -= self._wraps * math.tau * np.copysign(turns, error)
        rate = self._error_rate
        if self._given_rates:
            np.subtract(self._rate, measured.velocity, rate)
        else:
            rate[:] = (error - self._before) / period if self._has_before else 0.0
        if not math.hypot(*self._all_errors.tolist()) < math.inf:
            refuse_not_finite(self.name, self.joints, measured, time)
        self._before[:] = error
        self._has_before = True
        command = output.command
        self._pid.apply(self._errors, period, command)
        np.multiply(self._forward, self._rate if self._given_rates else self._reference, out=self._fed)
        command += self._fed
        if self._led_velocity:
            output.velocity[:] = self._reference
            np.multiply(self._reference, period, out=output.position)
            np.add(output.position, measured.position, out=output.position)
        else:
            output.position[:] = self._reference
            output.velocity[:] = self._rate
        return output


def _counted(gains: Sequence[GainsSpec]) -> tuple[GainsSpec, ...]:
    """With the feed-forward where a PID has it: it alone makes a joint move, too."""
    return tuple(g.model_copy(update={"ff_velocity_scale": getattr(g, "feedforward_gain", 0.0)}) for g in gains)


def build(name: str, spec: PidSpec, context: BuildContext) -> PidController:
    """The controller of a spec."""
    return PidController(
        name=name,
        joints=spec.joints,
        gains=spec.gains,
        interface=spec.command_interface,
        led=spec.reference_and_state_interfaces,
        types=[context.robot.joint(joint).type for joint in spec.joints],
        hold_first=spec.set_current_state_as_first_setpoint,
        feed_forward="gravity" if spec.gravity_compensation else "none",
        compat=context.compat,
        chained_to=spec.chained_to,
    )


def check(spec: PidSpec, robot: RobotModel) -> Iterator[Problem]:
    """Gains of other joints, missing gains, gains all zero; interfaces that cannot be controlled together."""
    yield from strangers(robot, spec.joints, spec.gains, ("gains",), "gains", "CTRL102")
    for joint in own_joints(robot, spec.joints):
        own = spec.gains.get(joint)
        if own is None or own.p == own.i == own.d == own.feedforward_gain == 0.0:
            what = "has no gains" if own is None else "has gains that are all zero"
            loc = ("gains",) if own is None else ("gains", joint)
            yield Problem(loc, f"joint '{joint}' {what}; it would not move", f"give gains.{joint}.p", "CTRL103")
        elif own.ff_velocity_scale:
            message, hint = "ff_velocity_scale has no effect in a `pid` controller", "use feedforward_gain"
            yield Problem(("gains", joint, "ff_velocity_scale"), message, hint, "CTRL182")
    if len({gains.save_i_term for gains in spec.gains.values()}) > 1:
        yield Problem(
            ("gains",), "save_i_term differs between its joints", "use one controller for each value", "CTRL182"
        )
    if spec.reference_and_state_interfaces not in (("position",), ("position", "velocity"), ("velocity",)):
        message = f"{list(spec.reference_and_state_interfaces)} cannot be controlled together"
        hint = "use [position], [position, velocity] or [velocity]"
        yield Problem(("reference_and_state_interfaces",), message, hint, "CTRL182")
    small = [joint for joint in spec.joints if (own := spec.gains.get(joint)) is not None and not own.feedforward_gain]
    if spec.command_interface == "position" and spec.reference_and_state_interfaces == ("position",) and small:
        message = f"joint '{small[0]}' has no feedforward_gain: its position command is p times its error, near 0"
        yield Problem(
            ("gains", small[0]), message, "for reference + PID, use feedforward_gain: 1", "CTRL182", "warning"
        )
    if spec.gravity_compensation and spec.command_interface != "effort":
        message = f"gravity_compensation needs the effort interface, not {spec.command_interface}"
        yield Problem(
            ("gravity_compensation",),
            message,
            "use command_interface: effort, or remove gravity_compensation",
            "CTRL147",
        )


def loop(spec: PidSpec) -> ControlLoop:
    """A PID loop if the velocity is controlled, too; otherwise de/dt is a difference of errors, another law."""
    if spec.reference_and_state_interfaces != ("position", "velocity"):
        return NoLoop("its de/dt is a difference of errors, for which no gains are proposed")
    return PidLoop(spec.gains, spec.gravity_compensation, tunable=False)


MEMBER = ControllerMember(name="pid", spec=PidSpec, build=build, check=check, loop=loop)
