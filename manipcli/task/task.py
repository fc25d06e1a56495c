"""A checked task: what the user wrote, and what it means for this robot and scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from manipcli.core.errors import Diagnostic, Loc
from manipcli.judge.drawn import Drawn
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec
from manipcli.spec.task import TaskSpec


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """What is simulated, where planning knows something else: robot and scene of the engine, controllers and gains."""

    robot: RobotModel
    scene: Scene
    controllers: Located[ControllersSpec]


@dataclass(frozen=True, slots=True)
class Task:
    """A task that can be planned: the three files as written, and the robot and scene that they mean.

    `findings` are warnings and notes; errors do not get here. `places`: where steps, expectations and watches were
    written, of a task that was read from a log.
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

    @property
    def true(self) -> GroundTruth:
        """What is simulated."""
        return self.truth or GroundTruth(self.robot, self.scene, self.controllers_file)

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """Its findings without notes."""
        return tuple(finding for finding in self.findings if finding.severity == "warning")

    @property
    def name(self) -> str:
        """As in `task:`."""
        return self.file.spec.task

    @property
    def spec(self) -> TaskSpec:
        """The task file."""
        return self.file.spec

    @property
    def controllers(self) -> ControllersSpec:
        """The controllers file."""
        return self.controllers_file.spec

    def log_place(self, *path: str | int) -> str:
        """`pour.yaml:21:5`: no folder of this machine gets into a log."""
        if path in self.places:
            return self.places[path]
        place = self.file.place(*path)
        return f"{Path(place.file).name}:{place.line}:{place.column}"
