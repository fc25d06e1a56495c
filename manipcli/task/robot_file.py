"""A robot file, and the robot that it means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from manipcli.core.errors import Finding
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel
from manipcli.spec.load import load_robot, salvage_robot_file
from manipcli.spec.located import Located
from manipcli.spec.partial.partial_robot import is_whole
from manipcli.spec.robot import RobotSpec
from manipcli.task.gathered import Gathered


@dataclass(frozen=True, slots=True)
class RobotFile:
    """What a robot file says; `file` is None where it was refused.

    `robot`: what it means, with warnings and notes; also of a refused file where it lacks nothing that others name.
    """

    file: Located[RobotSpec] | None
    robot: tuple[RobotModel, tuple[Finding, ...]] | None


def gather_robot(
    path: Path,
    gathered: Gathered,
    *,
    overrides: Sequence[str] = (),
    package_path: Sequence[Path],
    allow_outside: bool,
) -> RobotFile:
    """As `read_robot`, but every error goes to `gathered`: one in the file hides none of what it says of the robot."""
    file = gathered(lambda: load_robot(path, overrides=overrides))
    read = file or salvage_robot_file(path, overrides=overrides)
    if read is None:
        return RobotFile(None, None)
    building = Gathered()
    robot = building(
        lambda: build_robot(
            read.spec, file=path, package_path=package_path, allow_outside=allow_outside, source=read.source
        )
    )
    # Notes on what is not stated may speak of what was left out.
    gathered.findings += [finding for finding in building.findings if file or finding.severity == "error"]
    return RobotFile(file, robot if is_whole(read) else None)


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
    gathered = Gathered()
    read = gather_robot(path, gathered, package_path=package_path, allow_outside=allow_outside)
    if read.file is None or read.robot is None:
        raise gathered.refusal()
    robot, notes = read.robot
    return read.file, robot, (*read.file.findings, *notes)
