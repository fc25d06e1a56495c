"""All controllers of a robot at once: joint vectors in, one command vector out, once per control period.

    manager = build_controllers(spec, robot, period)      # factory.py; or ControllerManager([...], joints=..., ...)
    limiter = manager.limiter([joint.limits for joint in robot.moving_joints])
    commands = manager.update(time, state, feed_forward, contact_force)    # (n) before limits, until the next update
    limited = limiter.apply(commands, state.position, state.velocity, period)

where every vector (n) follows `RobotModel.joint_names`; `state` has `position`, `velocity`, `effort` (a `WorldState`
will do); `feed_forward` (n) is gravity or inverse dynamics for all joints at once (`manager.feed_forward` says which
joint wants which); `contact_force` (n) [N] is the normal force of contacts on the links that each joint moves, up to
the next joint. `manager.outputs` are the outputs of the last update in the order of `manager.controllers`;
`manager.interfaces` (n) says what each command is (None: a mimic joint, its command stays 0). Goals go to the
controllers: `manager["arm_controller"].send_goal(...)`, or `manager.serving(joints)` finds the one that claims them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from manipcli.control.controller import Controller, ControllerOutput, FeedForward, Interface, JointState
from manipcli.control.limits import JointLimiter
from manipcli.core.errors import Finding, InvalidArgument, InvalidInput
from manipcli.core.geometry import Array
from manipcli.model.robot import JointLimits

Index = slice | npt.NDArray[np.intp]


class JointVectors(Protocol):
    """Measured joints of the whole robot, arrays (n)."""

    @property
    def position(self) -> Array: ...
    @property
    def velocity(self) -> Array: ...
    @property
    def effort(self) -> Array: ...


@dataclass(slots=True, eq=False)
class _Slot:
    """A controller, where its joints stand in a joint vector, and what was measured there: rows of `copy`, which is
    taken anew every tick; None where they are a part of the manager's own."""

    controller: Controller
    index: Index
    measured: JointState
    copy: Array | None
    adds: bool


class ControllerManager:
    """Holds the active controllers of one robot.

    Args:
        controllers: distinct names; none claims a joint that another one claims.
        joints: (n) all moving joints of the robot, in the order of its joint vectors.
        period: [s] between two updates.
        following: joints that are not to be commanded, because they follow others (mimic).

    Raises:
        InvalidInput: every conflict at once: a joint claimed twice, unknown, following, or claimed by nobody.
    """

    def __init__(
        self,
        controllers: Sequence[Controller],
        *,
        joints: Sequence[str],
        period: float,
        following: Sequence[str] = (),
    ) -> None:
        self.controllers = tuple(controllers)
        self.joints = tuple(joints)
        self.period = period
        findings = claim_findings(self.controllers, self.joints, tuple(following))
        if findings:
            raise InvalidInput(findings)
        n = len(self.joints)
        self._commands = np.zeros(n)
        self._measured = np.zeros((3, n))
        self._slots = [self._slot(controller) for controller in self.controllers]
        interfaces: list[Interface | None] = [None] * n
        wants: list[FeedForward] = ["none"] * n
        for controller in self.controllers:
            for name in controller.joints:
                interfaces[self.joints.index(name)] = controller.interface
                wants[self.joints.index(name)] = controller.feed_forward
        self.interfaces = tuple(interfaces)
        self.feed_forward = tuple(wants)
        self.outputs: tuple[ControllerOutput, ...] = ()

    def _slot(self, controller: Controller) -> _Slot:
        where = [self.joints.index(name) for name in controller.joints]
        index: Index = np.array(where, dtype=np.intp)
        adjacent = where == list(range(where[0], where[0] + len(where)))
        if adjacent:
            index = slice(where[0], where[0] + len(where))
        rows = self._measured[:, index]
        return _Slot(
            controller=controller,
            index=index,
            measured=JointState(position=rows[0], velocity=rows[1], effort=rows[2]),
            copy=None if adjacent else rows,
            adds=controller.feed_forward != "none",
        )

    def __getitem__(self, name: str) -> Controller:
        for controller in self.controllers:
            if controller.name == name:
                return controller
        raise KeyError(f"no controller '{name}'; known: {', '.join(c.name for c in self.controllers)}")

    def index(self, name: str) -> Index:
        """Where the joints of a controller stand in a joint vector."""
        return next(slot.index for slot in self._slots if slot.controller.name == name)

    def serving(self, joints: Sequence[str]) -> Controller:
        """The controller that claims all of `joints`.

        Raises:
            InvalidArgument: none does.
        """
        for controller in self.controllers:
            if set(joints) <= set(controller.joints):
                return controller
        claims = "; ".join(f"{c.name}: {', '.join(c.joints)}" for c in self.controllers)
        raise InvalidArgument("CTRL140", f"no controller claims all of {', '.join(joints)} ({claims})")

    def limiter(self, limits: Sequence[JointLimits]) -> JointLimiter:
        """A limiter of the commands, for the limits (n) of all joints."""
        return JointLimiter(limits, self.interfaces)

    def update(
        self,
        time: float,
        state: JointVectors,
        feed_forward: Array | None = None,
        contact_force: Array | None = None,
    ) -> Array:
        """One control tick at `time` [s]: the commands (n) before limits; see the module for the vectors."""
        measured = self._measured
        measured[0], measured[1], measured[2] = state.position, state.velocity, state.effort
        commands, period = self._commands, self.period
        outputs = []
        for slot in self._slots:
            index = slot.index
            if slot.copy is not None:
                slot.copy[:] = measured[:, index]
            addition = feed_forward[index] if slot.adds and feed_forward is not None else None
            force = contact_force[index] if contact_force is not None else None
            output = slot.controller.update(time, period, slot.measured, addition, contact_force=force)
            commands[index] = output.command
            outputs.append(output)
        self.outputs = tuple(outputs)
        return commands

    def deactivate(self, time: float) -> None:
        """Ends all goals as aborted; the next update activates the controllers again."""
        for controller in self.controllers:
            controller.deactivate(time)


def claim_findings(
    controllers: Sequence[Controller], joints: tuple[str, ...], following: tuple[str, ...]
) -> tuple[Finding, ...]:
    """Everything that is wrong with who claims what."""
    findings = []
    names = [controller.name for controller in controllers]
    findings += [
        Finding(code="CTRL141", message=f"two controllers are named '{name}'")
        for name in dict.fromkeys(names)
        if names.count(name) > 1
    ]
    owner: dict[str, Controller] = {}
    for controller in controllers:
        for name in controller.joints:
            claim = f"{name}/{controller.interface}"
            if name in owner:
                other = owner[name]
                findings.append(
                    Finding(
                        code="CTRL142",
                        message=f"controllers '{other.name}' ({name}/{other.interface}) and '{controller.name}' "
                        f"({claim}) both claim joint '{name}'",
                    )
                )
            elif name in following:
                message = f"controller '{controller.name}' claims {claim}, but joint '{name}' follows another joint"
                findings.append(Finding(code="CTRL143", message=message))
            elif name not in joints:
                message = f"controller '{controller.name}' claims {claim}, but the robot has no such moving joint"
                findings.append(Finding(code="CTRL144", message=message))
            owner.setdefault(name, controller)
    idle = [name for name in joints if name not in owner and name not in following]
    if idle:
        findings.append(
            Finding(
                code="CTRL145",
                message=f"no controller commands {', '.join(repr(name) for name in idle)}",
                hint=f"add {'it' if len(idle) == 1 else 'them'} to a controller: a joint that nobody commands falls",
            )
        )
    return tuple(findings)
