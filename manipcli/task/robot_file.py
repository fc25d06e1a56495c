"""Loading of a robot file and its robot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel
from manipcli.spec.load import load_robot
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec
from manipcli.task.second_chances import every_robot_finding
from manipcli.task.sensor_checks import refuse, robot_sensor_findings
from manipcli.task.vocabulary import robot_spec


def read_robot(
    path: Path, *, package_path: Sequence[Path] = (), allow_outside: bool = False
) -> tuple[Located[RobotSpec], RobotModel, tuple[Diagnostic, ...]]:
    """Loads a robot file; returns the file, the robot, and the warnings and notes of both.

    Args:
        path: the robot file.
        package_path: additional folders to search for packages.
        allow_outside: allow files outside packages and outside the folder of the robot file.

    Raises:
        InvalidInput: all errors of the file and of the files it names.
    """
    try:
        file = load_robot(path, model=robot_spec())
        robot, notes = build_robot(
            file.spec, file=path, package_path=package_path, allow_outside=allow_outside, source=file.source
        )
        refuse(robot_sensor_findings(file, robot))
    except InvalidInput as first:
        raise every_robot_finding(path, first, package_path=package_path, allow_outside=allow_outside) from None
    return file, robot, (*file.findings, *notes)
