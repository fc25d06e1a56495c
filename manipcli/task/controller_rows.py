"""The controllers of a task and the interfaces that they claim, for tables."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from manipcli.control.factory import controller_findings
from manipcli.core.errors import InvalidInput
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.load import load_controllers
from manipcli.task.load_task import load_task
from manipcli.task.vocabulary import controllers_spec


@dataclass(frozen=True, slots=True)
class ControllerRow:
    """One controller, at the start of a task.

    Attributes:
        name, type: as in the controllers file.
        active: at the start.
        joints: joints that it commands or reads.
        interfaces: command interfaces that it claims on each joint while active.
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
        """The interfaces `joint/interface` that it claims while active."""
        return tuple(f"{joint}/{interface}" for joint in self.joints for interface in self.interfaces)


def controllers_of(path: Path) -> tuple[ControllerRow, ...]:
    """The controllers of a task, in the order of their file.

    Raises:
        InvalidInput: a file of the task cannot be used.
    """
    task = load_task(path)
    every = 1.0 / task.spec.simulation.control_period
    return tuple(
        ControllerRow(
            name,
            controller.type,
            controller.active,
            controller.joints,
            controller.interfaces,
            controller.update_rate or every,
        )
        for name, controller in task.controllers.controllers.items()
    )


def checked_controllers(path: Path, robot: RobotModel, period: float) -> ControllersSpec:
    """The controllers of a file, for a robot without a task.

    Args:
        path: the controllers file.
        robot: the robot.
        period: control period [s].

    Raises:
        InvalidInput: all errors of the file, or of its controllers with this robot.
    """
    file = load_controllers(path, model=controllers_spec())
    findings = controller_findings(file.spec, robot, period, place=lambda loc: file.place(*loc))
    errors = [finding for finding in findings if finding.severity == "error"]
    if errors:
        raise InvalidInput(errors)
    return file.spec
