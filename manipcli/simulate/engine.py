"""The contract of engines: a world that can be read, commanded and stepped.

A constructed engine is usable: the robot stands at its start position, the bodies at theirs. One engine object owns one
world; two in one process do not meet. Engines know no time: the session counts ticks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

from manipcli.control.command import JointCommand
from manipcli.core.errors import Diagnostic
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene


@dataclass(frozen=True, slots=True)
class EngineSettings:
    """`step` [s]: one physics step; `substeps`: physics steps a control tick; `start` (n): where the joints begin."""

    step: float
    substeps: int
    start: Array


class Engine(Protocol):
    """Joint vectors follow `RobotModel.moving_joints`, body arrays `Scene.movable`."""

    @property
    def ideal(self) -> bool:
        """Whether it follows references instead of commands."""
        ...

    def read(self, *, velocities: bool = True) -> WorldState:
        """The true state now; `time` is the session's to fill. The arrays are overwritten by the next read.

        Without `velocities` those of the bodies may stay as they were read last.
        """
        ...

    def write(self, command: JointCommand) -> None:
        """What the joints obey until the next write; an ideal engine makes the references in it come true."""
        ...

    def sense_wrench(self, joint: str) -> Array:
        """A force/torque sensor at a joint, fixed or not, from now on.

        Returns:
            (6) force [N] and torque [N m] that the child link, with all that hangs on it, puts on the parent, in the
            child's frame L and about its origin; overwritten by every read. Zeros before the first tick, and always
            in an engine without physics.
        """
        ...

    def advance(self) -> None:
        """One control tick: `substeps` physics steps."""
        ...

    def touches_changed(self) -> bool:
        """Whether other things touch than when `contacts` was last asked, or some point of contact of the robot carries
        much more than any of them did; cheaper than to ask it."""
        ...

    def contacts(self) -> tuple[Contact, ...]:
        """Everything that touches now, sorted by the names of the parts."""
        ...

    def close(self) -> None:
        """Free the world; the engine is unusable afterwards."""
        ...


@dataclass(frozen=True, slots=True)
class EngineMember:
    """A member of the seam.

    Attributes:
        name: as in `simulation: {engine: ...}`.
        physics: tells judges what can be known: "none" leaves objects where they stand.
        refuses: (robot) -> everything for which the engine cannot hold this robot.
        open: (robot, scene, settings) -> a running engine, for a robot that it does not refuse.
        version: of the engine, for the log.
        prepare: imports the engine's library, which otherwise the first world does.
    """

    name: str
    physics: Literal["full", "none"]
    refuses: Callable[[RobotModel], tuple[Diagnostic, ...]]
    open: Callable[[RobotModel, Scene, EngineSettings], Engine]
    version: Callable[[], str]
    prepare: Callable[[], object]
