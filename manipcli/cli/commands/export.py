"""`manipcli export ROBOT|TASK --ros2 DIR`: a robot, its controllers and the goals of a plan for ROS 2."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Overrides, PackagePath, Seed
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.text import listed, number_of


def export(
    file: Annotated[
        Path, typer.Argument(metavar="ROBOT|TASK", help="Robot file, description or task.", show_default=False)
    ],
    *,
    ros2: Annotated[
        Path, typer.Option("--ros2", metavar="DIR", help="Folder of the files for ROS 2.", show_default=False)
    ],
    controllers: Annotated[
        Path | None, typer.Option("--controllers", metavar="FILE", help="Controllers file, for a robot without a task.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write into a folder that is not empty.")] = False,
    seed: Seed = None,
    overrides: Overrides = None,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Write a robot or a planned task for ROS 2.

    URDF with a ros2_control block, SRDF, controllers.yaml and, for a task, each goal of the plan as YAML, with a
    script that sends them in order.
    """
    _check_folder(ros2, force=force)
    from manipcli import pipeline
    from manipcli.core.whole_file import write_whole

    files, notes = pipeline.ros2_files(
        file,
        controllers=controllers,
        overrides=tuple(overrides or ()),
        seed=seed,
        package_path=tuple(package_path or ()),
        allow_outside=allow_outside,
    )
    for name, text in files.items():
        path = ros2 / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text.encode())
        if name.endswith(".sh"):
            path.chmod(path.stat().st_mode | 0o111)
        if not name.startswith("goals/"):
            console.talk(f"written: {path}")
    goals = sum(name.startswith("goals/") for name in files)
    if goals:
        console.talk(f"written: {ros2 / 'goals'}, {number_of(goals, 'goal')}")
    old = sorted(path.name for path in (ros2 / "goals").glob("*.yaml") if f"goals/{path.name}" not in files)
    if old:
        notes += (f"{ros2 / 'goals'} has other files, which the script does not send: {listed(old, most=3)}",)
    for note in notes:
        console.talk(f"note: {note}")
    return ExitCode.PASSED


def _check_folder(folder: Path, *, force: bool) -> None:
    """
    Raises:
        InvalidInput: the folder is a file, or is not empty and `force` is not given.
    """
    if folder.exists() and not folder.is_dir():
        raise InvalidInput([Diagnostic("USE090", f"--ros2 '{folder}' is a file; expected a folder")])
    if not force and folder.is_dir() and any(folder.iterdir()):
        message = f"--ros2 '{folder}' is not empty; nothing was written"
        hint = "name another folder, or add --force to write into it"
        raise InvalidInput([Diagnostic("USE090", message, hint=hint)])
