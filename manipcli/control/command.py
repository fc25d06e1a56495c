"""What goes to the joints in one control tick: one block of numbers, and what of it each joint obeys."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final, Literal

import numpy as np

from manipcli.spec.controllers import Interface

Mode = Literal["effort", "velocity", "position", "brake", "free"]
"""What a joint obeys. `brake`: nobody commands it, so it is held at rest by as much effort as it has; `free`: it
follows another joint (mimic)."""

TOGETHER: Final[tuple[frozenset[Interface], ...]] = (
    frozenset({"position", "velocity", "acceleration"}),
    frozenset({"position", "effort"}),
)
"""Which interfaces of one joint may be commanded at once: any part of one of these, or one alone."""


class JointCommand:
    """Commands of all joints, arrays (n); overwritten every tick.

    A joint in the mode `position` is also told a `velocity` and an `effort` to add, which are 0 where nobody says.

    Attributes:
        modes: (n) what each joint obeys.
        version: grows when `modes` change.
        position, velocity, acceleration, effort: (n) the commands.
        reference_position, reference_velocity: (n) what the controllers follow; an ideal engine makes it come true.
    """

    __slots__ = (
        "acceleration", "effort", "modes", "position", "reference_position", "reference_velocity", "velocity",
        "version",
    )  # fmt: skip

    def __init__(self, joints: int) -> None:
        brake: Mode = "brake"
        self.modes: tuple[Mode, ...] = (brake,) * joints
        self.version = 0
        rows = np.zeros((6, joints))
        self.position, self.velocity, self.acceleration, self.effort = rows[:4]
        self.reference_position, self.reference_velocity = rows[4:]

    def obey(self, modes: Sequence[Mode]) -> None:
        """From now on each joint obeys this; what it was told before is forgotten."""
        if tuple(modes) != self.modes:
            self.modes = tuple(modes)
            self.version += 1
        for row in (self.position, self.velocity, self.acceleration, self.effort):
            row[:] = 0.0


def mode_of(interfaces: Collection[Interface]) -> Mode:
    """What a joint obeys that is commanded on these interfaces."""
    if "position" in interfaces:
        return "position"
    if "velocity" in interfaces:
        return "velocity"
    return "effort" if "effort" in interfaces else "brake"


def may_go_together(interfaces: Collection[Interface]) -> bool:
    """Whether one joint can be commanded on all of these at once."""
    wanted = frozenset(interfaces)
    return len(wanted) < 2 or any(wanted <= together for together in TOGETHER)
