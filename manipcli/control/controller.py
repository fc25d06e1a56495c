"""The contract of controllers: measured joints in, references and commands out, once per control period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from manipcli.core.geometry import Array

Interface = Literal["position", "velocity", "effort"]


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
    """A controller claims `joints` on one `interface`."""

    name: str
    joints: tuple[str, ...]
    interface: Interface

    def update(self, time: float, period: float, measured: JointState, feed_forward: Array | None = None) -> ControllerOutput:
        """One control tick at `time` [s]; `feed_forward` (n) is added to an effort command (gravity, dynamics)."""
        ...
