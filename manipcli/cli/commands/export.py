"""`manipcli export FILE`: a robot or a planned task for ROS 2, a recorded run for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.log_files import is_log, one_file
from manipcli.cli.options import AllowOutside, Overrides, PackagePath, Seed
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.text import listed, number_of


def export(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="Robot file, description or task for --ros2; else a log.", show_default=False
        ),
    ],
    *,
    ros2: Annotated[
        Path | None,
        typer.Option("--ros2", metavar="DIR", help="Robot or task: folder of the files for ROS 2.", show_default=False),
    ] = None,
    foxglove: Annotated[
        Path | None,
        typer.Option(
            "--foxglove", metavar="DIR", help="Log: folder with the log, its meshes and a layout for Foxglove."
        ),
    ] = None,
    rerun: Annotated[
        Path | None,
        typer.Option("--rerun", metavar="FILE.rrd", help="Log: recording for Rerun (needs manipcli[rerun])."),
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(
            "--rate", metavar="HZ", help="With --rerun: samples per second; 'inf' takes every tick [default: 50]."
        ),
    ] = None,
    rosbag2: Annotated[
        Path | None, typer.Option("--rosbag2", metavar="DIR", help="Log: folder that `ros2 bag` reads.")
    ] = None,
    glb: Annotated[
        Path | None, typer.Option("--glb", metavar="FILE.glb", help="Log: animation for Blender, as glTF 2.0.")
    ] = None,
    files: Annotated[
        Path | None, typer.Option("--files", metavar="DIR", help="Log: its task as files, ready to run.")
    ] = None,
    controllers: Annotated[
        Path | None, typer.Option("--controllers", metavar="FILE", help="Controllers file, for a robot without a task.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write into a folder that is not empty.")] = False,
    seed: Seed = None,
    overrides: Overrides = None,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Write a robot or a planned task for ROS 2, or a recorded run for other programs.

    --ros2: URDF with a ros2_control block, SRDF, controllers.yaml and, for a task, each goal of the plan as YAML, with
    a script that sends them in order. The other options need a log, and can be combined.
    """
    of_log = (("--foxglove", foxglove), ("--rerun", rerun), ("--rosbag2", rosbag2), ("--glb", glb), ("--files", files))
    of_task = (
        ("--ros2", ros2),
        ("--controllers", controllers),
        ("--seed", seed),
        ("--set", overrides or None),
    )
    log = is_log(file)
    _check_fit(file, of_task if log else (*of_log, ("--rate", rate)), log=log)
    if all(path is None for _, path in (*of_log, ("--ros2", ros2))):
        expected = [option for option, _ in of_log] if log else ["--ros2"]
        raise InvalidInput([Diagnostic("USE096", f"nothing to write: expected {' or '.join(expected)}")])
    for option, folder in (("--ros2", ros2), ("--foxglove", foxglove), ("--rosbag2", rosbag2), ("--files", files)):
        if folder is not None:
            _check_folder(option, folder, force=force)
    if log:
        from manipcli.cli.log_exports import LogExports

        exports = LogExports(foxglove=foxglove, rerun=rerun, rosbag2=rosbag2, glb=glb, files=files, rate=rate)
        with one_file(file) as whole:
            return exports.write(whole, package_path=tuple(package_path or ()), allow_outside=allow_outside)
    assert ros2 is not None
    return _for_ros2(
        file,
        ros2,
        controllers=controllers,
        seed=seed,
        overrides=tuple(overrides or ()),
        package_path=tuple(package_path or ()),
        allow_outside=allow_outside,
    )


def _for_ros2(
    file: Path,
    ros2: Path,
    *,
    controllers: Path | None,
    seed: int | None,
    overrides: Sequence[str],
    package_path: Sequence[Path],
    allow_outside: bool,
) -> ExitCode:
    from manipcli import pipeline
    from manipcli.core.whole_file import write_whole

    files, notes = pipeline.ros2_files(
        file,
        controllers=controllers,
        overrides=overrides,
        seed=seed,
        package_path=package_path,
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


def _check_fit(file: Path, others: Sequence[tuple[str, object]], *, log: bool) -> None:
    """
    Args:
        file: what is exported.
        others: the options for the other kind of file, and their values.
        log: whether the file is a log.

    Raises:
        InvalidInput: one of them is given.
    """
    given = [option for option, value in others if value is not None]
    if not given:
        return
    if log:
        message = f"{listed(given)} {'needs' if len(given) == 1 else 'need'} a robot or a task; '{file}' is a log"
        hint = "write its task with --files DIR, and export that"
    else:
        message = f"{listed(given)} {'needs' if len(given) == 1 else 'need'} a log; '{file}' is not one"
        hint = "run the task first: `manipcli run TASK` writes runs/<task>.mcap"
    raise InvalidInput([Diagnostic("USE097", message, hint=hint)])


def _check_folder(option: str, folder: Path, *, force: bool) -> None:
    """
    Raises:
        InvalidInput: the folder is a file, or is not empty and `force` is not given.
    """
    if folder.exists() and not folder.is_dir():
        raise InvalidInput([Diagnostic("USE090", f"{option} '{folder}' is a file; expected a folder")])
    if not force and folder.is_dir() and any(folder.iterdir()):
        message = f"{option} '{folder}' is not empty; nothing was written"
        hint = "name another folder, or add --force to write into it"
        raise InvalidInput([Diagnostic("USE090", message, hint=hint)])
