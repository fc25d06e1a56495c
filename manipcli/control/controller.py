"""The contract of controllers: measured joints in, references and commands out, once per control period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from manipcli.core.geometry import Array

Interface = Literal["position", "velocity", "effort"]

FeedForward = Literal["none", "gravity", "inverse_dynamics"]
"""What a controller wants added to its effort command."""


@dataclass(frozen=True, slots=True)
class JointState:
    """Measured joints of one controller, arrays (n) in the order of its joints; rad or m, per second, N m or N."""

    position: Array
    velocity: Array
    effort: Array


@dataclass(frozen=True, slots=True)
class ControllerOutput:
    """What a controller wants now. The arrays are only valid until its next update: copy to keep.

    Attributes:
        position, velocity, acceleration: (n) the reference.
        command: (n) in the controller's interface, before limits.
    """

    position: Array
    velocity: Array
    acceleration: Array
    command: Array


class Controller(Protocol):
    """A controller claims `joints` on one `interface`; `feed_forward` says what it wants added."""

    name: str
    joints: tuple[str, ...]
    interface: Interface
    feed_forward: FeedForward

    def update(
        self,
        time: float,
        period: float,
        measured: JointState,
        feed_forward: Array | None = None,
        *,
        contact_force: Array | None = None,
    ) -> ControllerOutput:
        """One control tick at `time` [s].

        `feed_forward` (n) is added to an effort command (gravity, dynamics). `contact_force` (n) [N] is the normal
        force of contacts on what each joint moves, up to the next joint; None where nobody senses it.
        """
        ...

    def deactivate(self, time: float) -> None:
        """Ends its goal as aborted and forgets its state; the next update activates it again."""
        ...
