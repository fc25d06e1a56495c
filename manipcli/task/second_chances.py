"""Collection of all errors of a task or robot file after loading it failed.

A refused file is read a second time without its invalid values, so that one error does not hide others: names are
checked against the rest of the file, or against placeholders. The result is never planned or simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.description.packages import Packages
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene_names import misnamed
from manipcli.spec import load
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located, apart
from manipcli.spec.partial.partial_robot import is_whole
from manipcli.spec.robot import Arguments, RobotSpec
from manipcli.spec.task import TaskSpec
from manipcli.task.changed_files import Files, out_of_range
from manipcli.task.compliance_checks import compliance_findings
from manipcli.task.consistency import disagreements, not_there
from manipcli.task.named_file import named_file
from manipcli.task.placeholders import named_robot, named_scene
from manipcli.task.sensor_checks import robot_sensor_findings, sensed, sensor_findings
from manipcli.task.spring_checks import spring_findings
from manipcli.task.task_files import finder
from manipcli.task.vary import bind
from manipcli.task.vocabulary import controllers_spec, robot_spec, task_spec

LEFT_OUT: Final = "CTRL214"
"""Code of findings about what is left out of a file of ROS."""

T = TypeVar("T")


def every_finding(
    path: Path,
    first: InvalidInput,
    *,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    design: str = "",
) -> InvalidInput:
    """All errors of a task and of the files it names, in the order of files and lines.

    Args:
        path: the task file.
        first: the error that stopped loading.
        overrides, seed, package_path, allow_outside, design: the options with which it was loaded.
    """
    errors = _Errors()
    model = task_spec()
    find = finder(path, package_path=package_path, allow_outside=allow_outside)
    task = errors.of(lambda: load.load_task(path, model=model, overrides=overrides, seed=seed, find=find))
    partial = task or load.salvage_task(path, model=model, overrides=overrides, seed=seed, find=find)
    if partial is None:
        return errors.refusal(first)
    errors.unknown = partial.source.unknown
    if task is None:
        errors.found += (*partial.findings, *misnamed(partial.spec, lambda loc: partial.place(*loc)))
    robot_path = _named(errors, partial, path, "robot")
    controllers_path = _named(errors, partial, path, "controllers")
    robot = _Robot.read(robot_path, errors, overrides, package_path, allow_outside)
    args = {} if robot.file is None else robot.file.spec.args
    controllers_file, partial_controllers = _controllers(errors, controllers_path, overrides, args)
    scene = None
    if task is not None:
        packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
        scene = errors.of(lambda: build_scene(task.spec, place=lambda loc: task.place(*loc), packages=packages))
    known_scene = scene or named_scene(partial.spec)
    if robot.model is not None:
        sensors = sensed(partial, robot.file, robot.model, known_scene)
        found = disagreements(partial, partial_controllers, robot.model, known_scene, sensors)
        errors.found += [finding for finding in found if finding.severity == "error"]
        errors.found += sensor_findings(partial, robot.file, partial_controllers, robot.model, known_scene)
    else:
        errors.found += not_there(partial, named_robot(partial.spec), known_scene, None)
    if task is not None and scene is not None:
        errors.found += spring_findings(task, scene)
    if task is not None and robot.file is not None and controllers_file is not None:
        if robot.model is not None and not errors.found:
            errors.found += compliance_findings(task, robot.file, controllers_file, robot.model)
        varied, wrong = bind(task, robot.file, controllers_file)
        errors.found += (*wrong, *out_of_range(Files(task, robot.file, controllers_file), varied))
    if errors.found and controllers_file is not None:
        # A controller that was left out is why no step can use its joints.
        left_out = (finding for finding in controllers_file.findings if finding.code == LEFT_OUT)
        errors.found += [finding for finding in left_out if finding.message.startswith("controller '")]
    return errors.refusal(first)


def every_robot_finding(
    path: Path,
    first: InvalidInput,
    *,
    overrides: Sequence[str] = (),
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
) -> InvalidInput:
    """All errors of a robot file and of its descriptions; arguments as of `every_finding`."""
    errors = _Errors()
    _Robot.read(path, errors, overrides, package_path, allow_outside, alone=True)
    return errors.refusal(first)


class _Errors:
    """Findings of several stages. `unknown`: places of unknown values, see `Source`."""

    def __init__(self) -> None:
        self.found: list[Diagnostic] = []
        self.unknown: frozenset[Place] = frozenset()

    def of(self, stage: Callable[[], T]) -> T | None:
        """The result of a stage; None if it refused its input."""
        try:
            return stage()
        except InvalidInput as invalid:
            self.found += invalid.findings
            return None

    def refusal(self, first: InvalidInput) -> InvalidInput:
        """All findings in the order of files and lines; `first` if the second reading finds none."""
        if not self.found:
            return first
        files = list(dict.fromkeys(finding.place.file for finding in self.found if finding.place is not None))

        def position(finding: Diagnostic) -> tuple[int, int, int]:
            place = finding.place
            return (-1, 0, 0) if place is None else (files.index(place.file), place.line, place.column)

        return InvalidInput(sorted(apart(self.found, self.unknown), key=position))


@dataclass(frozen=True, slots=True)
class _Robot:
    """A robot file and its robot. `file` is None if it is refused; `model` is None if names that a task uses may be
    missing."""

    file: Located[RobotSpec] | None
    model: RobotModel | None

    @classmethod
    def read(
        cls,
        path: Path | None,
        errors: _Errors,
        overrides: Sequence[str],
        package_path: Sequence[Path],
        allow_outside: bool,
        *,
        alone: bool = False,
    ) -> _Robot:
        if path is None:
            return cls(None, None)
        file = errors.of(lambda: load.load_robot(path, overrides=overrides, model=robot_spec()))
        partial = file or load.salvage_robot_file(path, overrides=overrides, model=robot_spec())
        if partial is None:
            return cls(None, None)
        building = _Errors()
        built = building.of(
            lambda: build_robot(
                partial.spec, file=path, package_path=package_path, allow_outside=allow_outside, source=partial.source
            )
        )
        # Notes on missing values may concern values that were removed.
        errors.found += [finding for finding in building.found if file is not None or finding.severity == "error"]
        if file is not None and built is not None and alone:
            errors.found += robot_sensor_findings(file, built[0])
        return cls(file, built[0] if built is not None and is_whole(partial) else None)


def _named(errors: _Errors, task: Located[TaskSpec], path: Path, key: str) -> Path | None:
    """The file that the task names; None if it is missing or its name was refused."""
    return errors.of(lambda: named_file(task, path, key)) if task.source.untouched(key) else None


def _controllers(
    errors: _Errors, path: Path | None, overrides: Sequence[str], args: Arguments
) -> tuple[Located[ControllersSpec] | None, Located[ControllersSpec] | None]:
    """The controllers file (None if refused), and its valid part."""
    if path is None:
        return None, None
    file = errors.of(lambda: load.load_controllers(path, model=controllers_spec(), overrides=overrides, args=args))
    return file, file or load.salvage_controllers_file(path, model=controllers_spec(), overrides=overrides, args=args)
