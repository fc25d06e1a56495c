"""Loading of a description, a robot file or a task for viewing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.geometry import Array
from manipcli.description.expanded import is_plain, takes_no_arguments
from manipcli.description.lint.inspection import DESCRIPTIONS
from manipcli.model.build_robot import build_robot
from manipcli.model.configuration import configuration
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.spec import load
from manipcli.spec.robot import RobotSpec
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import start_position
from manipcli.task.robot_file import read_robot


@dataclass(frozen=True, slots=True)
class Sight:
    """A robot, its scene (for a task), its start configuration `q` (n,) [rad or m], and warnings and notes."""

    robot: RobotModel
    scene: Scene | None
    q: Array
    findings: tuple[Diagnostic, ...]


def load_sight(
    path: Path,
    *,
    arguments: Mapping[str, str] = {},
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
) -> Sight:
    """Loads a file for viewing.

    Args:
        path: URDF, xacro, robot file or task.
        arguments: arguments of a xacro file, `NAME:=VALUE`.
        package_path, allow_outside: see `load_task`.

    Raises:
        InvalidInput: all errors of the file.
    """
    if path.suffix.lower() in DESCRIPTIONS:
        load.read_bytes(path)  # same error for a missing file as for every other kind
        if arguments and is_plain(path):
            raise takes_no_arguments(path, arguments)
        spec = RobotSpec(robot=path.name.partition(".")[0], description=path.name, args=dict(arguments))
        robot, notes = build_robot(spec, file=path, package_path=package_path, allow_outside=allow_outside)
        # Only robot files set acceleration limits.
        return Sight(robot, None, configuration(robot), tuple(note for note in notes if note.code != "ROBOT330"))
    if arguments:
        names = ", ".join(arguments)
        raise InvalidInput(
            [Diagnostic("VIEW002", f"arguments need a URDF or xacro file; given: {names}", Place(str(path), 0, 0))]
        )
    kind = load.kind_of(path)
    if kind == "task":
        task = load_task(path, package_path=package_path, allow_outside=allow_outside)
        return Sight(task.robot, task.scene, start_position(task), task.findings)
    if kind == "controllers":
        message = "a controllers file cannot be viewed; give a robot file, a description or a task"
        raise InvalidInput([Diagnostic("VIEW003", message, Place(str(path), 0, 0))])
    _, robot, findings = read_robot(path, package_path=package_path, allow_outside=allow_outside)
    return Sight(robot, None, configuration(robot), findings)
