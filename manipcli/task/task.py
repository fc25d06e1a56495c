"""A checked task: its files, robot and scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from manipcli.core.errors import Diagnostic, Loc
from manipcli.judge.drawn import Drawn
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec
from manipcli.spec.sensors import SensorSpec
from manipcli.spec.task import TaskSpec
from manipcli.task.part import WHOLE, Part


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """Robot, scene, controllers and sensors of the simulation, if they differ from those known to the planner."""

    robot: RobotModel
    scene: Scene
    controllers: Located[ControllersSpec]
    sensors: Mapping[str, SensorSpec]


@dataclass(frozen=True, slots=True)
class Task:
    """A task that can be planned: its three files, and the robot and scene built from them.

    Attributes:
        findings: warnings and notes; errors are raised.
        places: places of steps, expectations and watches, for a task read from a log.
        drawn: the drawn values of a sample.
        truth: the ground truth of a sample, if it differs.
        part: the steps that a run does.
    """

    file: Located[TaskSpec]
    robot_file: Located[RobotSpec]
    controllers_file: Located[ControllersSpec]
    robot: RobotModel
    scene: Scene
    findings: tuple[Diagnostic, ...]
    places: Mapping[Loc, str] = field(default_factory=dict)
    drawn: Drawn | None = None
    truth: GroundTruth | None = None
    part: Part = WHOLE

    @property
    def true(self) -> GroundTruth:
        """The ground truth of the simulation."""
        return self.truth or GroundTruth(self.robot, self.scene, self.controllers_file, self.sensors)

    @property
    def known(self) -> Task:
        """The task as the planner knows it: without drawn values and ground truth."""
        return replace(self, drawn=None, truth=None)

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """The findings without notes."""
        return tuple(finding for finding in self.findings if finding.severity == "warning")

    @property
    def name(self) -> str:
        """The name under `task:`."""
        return self.file.spec.task

    @property
    def spec(self) -> TaskSpec:
        """The task file."""
        return self.file.spec

    @property
    def controllers(self) -> ControllersSpec:
        """The controllers file."""
        return self.controllers_file.spec

    @property
    def sensors(self) -> Mapping[str, SensorSpec]:
        """The sensors of the robot file, then those of the task, by name; `true` has those of a sample."""
        return all_sensors(self.robot_file.spec, self.spec)

    def log_place(self, *path: str | int) -> str:
        """A place without its folder, for logs: `pour.yaml:21:5`."""
        if path in self.places:
            return self.places[path]
        place = self.file.place(*path)
        return f"{Path(place.file).name}:{place.line}:{place.column}"


def all_sensors(robot: RobotSpec, task: TaskSpec) -> dict[str, SensorSpec]:
    """The sensors of a robot file, then those of a task, by name."""
    return {**(robot.sensors or {}), **(task.sensors or {})}
