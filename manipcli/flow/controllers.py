"""The controllers of a task, for whoever asks who claims what."""

from __future__ import annotations

from pathlib import Path

from manipcli.flow.load import load_task
from manipcli.report.controllers import ControllerRow


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
