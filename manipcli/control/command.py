"""Joint command of one control tick: one block of numbers, and the control mode of each joint."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final, Literal

import numpy as np

from manipcli.spec.controllers import Interface

Mode = Literal["effort", "velocity", "position", "brake", "free"]
"""Control mode of a joint. `brake`: uncommanded, so it is held at rest with up to its full effort; `free`: it follows
another joint (mimic)."""

TOGETHER: Final[tuple[frozenset[Interface], ...]] = (
    frozenset({"position", "velocity", "acceleration"}),
    frozenset({"position", "effort"}),
)
"""Interfaces of one joint that may be commanded together: any subset of one of these, or a single interface."""


class JointCommand:
    """Commands of all joints, arrays (n); overwritten every tick.

    A joint in the mode `position` also gets a feed-forward `velocity` and `effort`, 0 by default.

    Attributes:
        modes: (n) of the joints.
        version: grows when `modes` change.
        position, velocity, acceleration, effort: (n) the commands.
        reference_position, reference_velocity: (n) references of the controllers; an ideal engine tracks them exactly.
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
        """Set the modes of the joints and clear all commands."""
        if tuple(modes) != self.modes:
            self.modes = tuple(modes)
            self.version += 1
        for row in (self.position, self.velocity, self.acceleration, self.effort):
            row[:] = 0.0


def mode_of(interfaces: Collection[Interface]) -> Mode:
    """The mode of a joint that is commanded on these interfaces."""
    if "position" in interfaces:
        return "position"
    if "velocity" in interfaces:
        return "velocity"
    return "effort" if "effort" in interfaces else "brake"


def may_go_together(interfaces: Collection[Interface]) -> bool:
    """Whether one joint can be commanded on all of these at once."""
    wanted = frozenset(interfaces)
    return len(wanted) < 2 or any(wanted <= together for together in TOGETHER)
