"""The controllers of a task, for whoever asks who claims what."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from manipcli.task.load_task import load_task


@dataclass(frozen=True, slots=True)
class ControllerRow:
    """One controller, at the start of a task.

    Attributes:
        name, type: as in the controllers file.
        active: whether it is, at the start.
        joints: that it commands or reads.
        interfaces: that it claims of each of its joints while it is active.
        update_rate: [Hz].
    """

    name: str
    type: str
    active: bool
    joints: tuple[str, ...]
    interfaces: tuple[str, ...]
    update_rate: float

    @property
    def state(self) -> str:
        """`active` or `inactive`."""
        return "active" if self.active else "inactive"

    @property
    def wanted(self) -> tuple[str, ...]:
        """The `joint/interface` that it claims while it is active."""
        return tuple(f"{joint}/{interface}" for joint in self.joints for interface in self.interfaces)


def controllers_of(path: Path) -> tuple[ControllerRow, ...]:
    """The controllers of a task, in the order of their file.

    Raises:
        InvalidInput: a file of the task cannot be used.
    """
    task = load_task(path)
    every = 1.0 / task.spec.simulation.control_period
    return tuple(
        ControllerRow(name, one.type, one.active, one.joints, one.interfaces, one.update_rate or every)
        for name, one in task.controllers.controllers.items()
    )
