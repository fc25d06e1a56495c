"""Contract of engines: a world that can be read, commanded and stepped.

A constructed engine is ready: the robot and the bodies are at their start poses. One engine object owns one world; two
engines in one process are independent. Engines have no clock: the session counts ticks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

from manipcli.control.command import JointCommand
from manipcli.core.errors import Diagnostic, Loc
from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model


@dataclass(frozen=True, slots=True)
class EngineSettings:
    """Settings of one world.

    Attributes:
        step: one physics step [s].
        substeps: physics steps per control tick.
        start: (n) joint positions.
        own: the engine's own settings, of its `spec`; None: its defaults.
        self_collision: pairs of links that collide with each other, by name; other pairs pass through each other.
        velocity: (n) of the joints at the start; None: at rest.
        twists: (m, 6) velocity of each movable body's O and its angular velocity, in the world, at the start; None: at
            rest.
        sleep: whether islands of bodies that rest are left out of the physics until something touches them.
    """

    step: float
    substeps: int
    start: Array
    own: Model | None = None
    self_collision: tuple[tuple[str, str], ...] = ()
    velocity: Array | None = None
    twists: Array | None = None
    sleep: bool = False


class Refusal(NamedTuple):
    """Why an engine cannot simulate a task. `at`: location in the task file, for a finding without a place."""

    finding: Diagnostic
    at: Loc = ("robot",)


class Engine(Protocol):
    """Joint vectors follow `RobotModel.moving_joints`, body arrays `Scene.movable`."""

    @property
    def ideal(self) -> bool:
        """Whether it tracks references exactly, instead of executing commands."""
        ...

    def read(self, *, velocities: bool = True) -> WorldState:
        """The true state now; the session sets `time`. The arrays are overwritten by the next read.

        Without `velocities`, the velocities of bodies may be those of an earlier read.
        """
        ...

    def write(self, command: JointCommand) -> None:
        """Set the command of the joints until the next write; an ideal engine tracks its references exactly."""
        ...

    def sense_wrench(self, joint: str) -> Array:
        """Add a force/torque sensor at a joint, fixed or not.

        Returns:
            (6) force [N] and torque [N m] of the child link, with all links below it, on the parent, in the child's
            frame L and about its origin; overwritten by every read. Zeros before the first tick, and always in an
            engine without physics.
        """
        ...

    def attach(self, body: str) -> Array:
        """Fix a movable body to the tool where it is now; for robots with a `holding` only, and not while attached.

        Returns:
            (6) force [N] and torque [N m] of the attachment on the body, in the tool frame and about its origin, in the
            last physics step; overwritten by every read. Always zeros in an engine without physics.
        """
        ...

    def detach(self, body: str) -> None:
        """Free an attached body."""
        ...

    def body_state(self, body: str) -> tuple[Transform, Array]:
        """A movable body now, without a change of any other reading.

        Returns:
            `X_WO`, and the (6) velocity of O and angular velocity, in the world.
        """
        ...

    def place(self, body: str, X_WO: Transform, twist: Array) -> None:
        """Put a movable body, which is not attached, elsewhere between two ticks.

        The contacts of the last physics step are kept until the next one.

        Args:
            body: its name.
            X_WO: its new pose.
            twist: (6) velocity of O and angular velocity, in the world; without effect in an engine without physics.
        """
        ...

    def advance(self) -> None:
        """One control tick: `substeps` physics steps."""
        ...

    def touches_changed(self) -> bool:
        """Whether parts touch or part since the last call of `contacts`, or the force at a contact point of
        the robot grew a lot; cheaper than `contacts`."""
        ...

    def contacts(self, *, peek: bool = False) -> tuple[Contact, ...]:
        """All contacts now, sorted by the names of the parts; with `peek`, `touches_changed` ignores this call."""
        ...

    def close(self) -> None:
        """Free the world; the engine is unusable afterwards."""
        ...


@dataclass(frozen=True, slots=True)
class EngineMember:
    """A member of the seam.

    Attributes:
        name: as in `simulation: {engine: ...}`.
        physics: for judges: with "none", objects do not move.
        spec: its own settings, the block `simulation: {NAME: {...}}`; a model without fields has no block.
        refuses: (robot, scene, own settings) -> all reasons why the engine cannot simulate them.
        open: (robot, scene, settings) -> a running engine, without such reasons.
        chosen: (robot, scene, settings) -> values that the engine chose itself, for the log.
        version: of the engine, for the log.
        prepare: imports the engine's library, which is otherwise imported by the first world.
        missing: () -> how to install its library; "" where it is installed.
    """

    name: str
    physics: Literal["full", "none"]
    spec: type[Model]
    refuses: Callable[[RobotModel, Scene, Model | None], tuple[Refusal, ...]]
    open: Callable[[RobotModel, Scene, EngineSettings], Engine]
    chosen: Callable[[RobotModel, Scene, EngineSettings], Mapping[str, str]]
    version: Callable[[], str]
    prepare: Callable[[], object]
    missing: Callable[[], str] = lambda: ""
