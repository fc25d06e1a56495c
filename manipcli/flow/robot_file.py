"""A robot file, and the robot that it means."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from manipcli.core.errors import Finding
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel
from manipcli.spec.load import load_robot
from manipcli.spec.located import Located
from manipcli.spec.robot import RobotSpec


def read_robot(
    path: Path, *, package_path: Sequence[Path] = (), allow_outside: bool = False
) -> tuple[Located[RobotSpec], RobotModel, tuple[Finding, ...]]:
    """The file, the robot, and the warnings and notes of both.

    Args:
        path: the robot file.
        package_path, allow_outside: where packages are, and whether a file may lie outside of them.

    Raises:
        InvalidInput: the file, or what it names, cannot be used.
    """
    file = load_robot(path)
    robot, notes = build_robot(
        file.spec, file=path, package_path=package_path, allow_outside=allow_outside, source=file.source
    )
    return file, robot, (*file.findings, *notes)
