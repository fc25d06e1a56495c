"""Contract of controllers: measured joints in, references and commands out, once per control period.

A controller owns one block of numbers, its `ControllerOutput.rows`, and writes into it at every update; the loop does
not allocate. The manager adds the model-based efforts (gravity, inverse dynamics), for all controllers at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, Literal, Protocol, TypeVar

import numpy as np

from manipcli.conditions.condition import Problem
from manipcli.control.control_loop import ControlLoop, HandSettings
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.description.transmission import Compat
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import ControllerSpec, Interface, Role

if TYPE_CHECKING:
    from manipcli.control.stopping import StopPlanner
    from manipcli.model.kinematics import Kinematics

FeedForward = Literal["none", "gravity", "inverse_dynamics"]
"""What the manager adds to a controller's effort command."""

REFERENCE_ROWS = 3


@dataclass(frozen=True, slots=True)
class JointState:
    """Measured joints of one controller, arrays (n) in the order of its joints; rad or m, per second, N m or N."""

    position: Array
    velocity: Array
    effort: Array


def distinct(name: str, joints: Sequence[str]) -> tuple[str, ...]:
    """The joints of controller `name`, at least one and each once.

    Raises:
        InvalidArgument: they are not.
    """
    if not joints or len(set(joints)) != len(joints):
        raise InvalidArgument("CTRL101", f"controller '{name}': its joints must be distinct, and at least one")
    return tuple(joints)


def refuse_not_finite(name: str, joints: Sequence[str], measured: JointState, time: float) -> None:
    """
    Raises:
        InvalidArgument: a measured position or velocity is not finite; names the joint and the time [s].
    """
    for what, values in (("position", measured.position), ("velocity", measured.velocity)):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            message = f"the measured {what} of joint '{joints[bad[0]]}' is {values[bad[0]]} at t = {time:.3f} s"
            raise InvalidArgument("CTRL106", f"controller '{name}': {message}")


@dataclass(frozen=True, slots=True, eq=False)
class ControllerOutput:
    """Reference and commands of a controller. The arrays are only valid until its next update: copy to keep.

    Attributes:
        rows: (3 + k, n) everything below in one block: the reference, then a command for each of k interfaces.
        position, velocity, acceleration: (n) the reference; rad or m and its derivatives.
        commands: k arrays (n), one for each of the controller's interfaces, in their order; before limits.
        wanted_acceleration: (n) input of inverse dynamics; that of the reference, unless the law adds to it.
        speed: (1) trajectory seconds per second.
    """

    rows: Array
    position: Array
    velocity: Array
    acceleration: Array
    commands: tuple[Array, ...]
    wanted_acceleration: Array
    speed: Array = field(default_factory=lambda: np.ones(1))

    @classmethod
    def of(cls, joints: int, interfaces: int, *, speed: Array | None = None) -> ControllerOutput:
        """Zeros for this number of joints and interfaces; `speed`: that of another output."""
        rows = np.zeros((REFERENCE_ROWS + interfaces, joints))
        commands = tuple(rows[REFERENCE_ROWS:])
        return cls(rows, rows[0], rows[1], rows[2], commands, rows[2], np.ones(1) if speed is None else speed)

    @classmethod
    def published(cls, count: int) -> ControllerOutput:
        """Output of a broadcaster, which commands nothing: `rows` (1, count) are published; all else is empty."""
        none = np.zeros(0)
        return cls(np.zeros((1, count)), none, none, none, (), none)

    @property
    def command(self) -> Array:
        """(n) in the controller's first interface."""
        return self.commands[0]


@dataclass(frozen=True, slots=True)
class SensorRequest:
    """A wrench (6) that a controller reads: force [N] and torque [N m].

    Attributes:
        frame: the link or sensor whose frame it is measured in.
        joint: the truth between its links; "" with `sensor`.
        sensor: name of the sensor of the robot or task that measures it; "": the truth.
    """

    frame: str
    joint: str = ""
    sensor: str = ""


class Controller(Protocol):
    """A controller claims `joints` on `interfaces`; `feed_forward` is added to its effort."""

    name: str
    joints: tuple[str, ...]
    interfaces: tuple[Interface, ...]
    feed_forward: FeedForward

    @property
    def sensors(self) -> tuple[SensorRequest, ...]:
        """The sensors that it reads besides its joints; with any it is a `roles.SensorReader`."""
        ...

    @property
    def role(self) -> Role:
        """Its role for steps; `roles.py` defines the methods of each role."""
        ...

    @property
    def senses_contact(self) -> bool:
        """Whether it needs contact forces at its next update."""
        ...

    @property
    def output(self) -> ControllerOutput:
        """What the last update wrote; the same object for the controller's life."""
        ...

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        """One update at `time` [s], `period` [s] before the next.

        `contact_force` (n) [N] is the normal force of contacts on the links that each joint moves, up to the next joint
        that does not mimic it; for a joint that moves several fingers, the largest force on one of them. None if
        contacts are not sensed.
        """
        ...

    def deactivate(self, time: float, reason: str = ...) -> None:
        """Abort its goal for this reason and reset its state; the next update re-activates it."""
        ...


S = TypeVar("S", bound=ControllerSpec)


@dataclass(frozen=True, slots=True)
class BuildContext:
    """Context for building controllers: the robot, its kinematics (computed on first use), and the ROS version.

    `stop_planner`: plans stops without `compat`; None: they have a constant deceleration.
    """

    robot: RobotModel
    kinematics: Callable[[], Kinematics]
    compat: Compat | None
    stop_planner: StopPlanner | None = None


@dataclass(frozen=True, slots=True)
class ControllerMember(Generic[S]):
    """A member of the seam.

    Attributes:
        name: the word under `type`.
        spec: what the user writes.
        build: (name of the controller, spec, context) -> the controller, for a spec without errors; None if it is left
            out, which `check` reports.
        check: (spec, robot) -> problems of the spec with this robot.
        loop: (spec) -> its control law, for preflight checks and `manipcli tune`.
        hand: (spec) -> its limits; only for the role `hand`.
    """

    name: str
    spec: type[S]
    build: Callable[[str, S, BuildContext], Controller | None]
    check: Callable[[S, RobotModel], Iterable[Problem]]
    loop: Callable[[S], ControlLoop]
    hand: Callable[[S], HandSettings] | None = None
