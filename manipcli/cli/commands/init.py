"""`manipcli init [DIR]`: a small working project: a robot, its controllers, a task, and a CI workflow."""

from __future__ import annotations

import os
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import typer

from manipcli.cli import console
from manipcli.cli.new_project import enter, notes, refuse_conflicts, write_files
from manipcli.cli.options import AllowOutside, PackagePath, pose_numbers, xacro_arguments
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

if TYPE_CHECKING:
    from manipcli.cli.own_wheel import Installation

TEMPLATES: Final = Path(__file__).parents[1] / "project"
WORKFLOW: Final = ".github/workflows/manipcli.yml"
COMMON: Final = {"README.md": "README.md", ".gitignore": "gitignore", WORKFLOW: "github/workflows/manipcli.yml"}
"""Written files of every project, each with its template."""
EXAMPLE: Final = {
    "tasks/pick_place.yaml": "tasks/pick_place.yaml",
    "robots/panda.yaml": "robots/panda.yaml",
    "controllers/panda.yaml": "controllers/panda.yaml",
}
"""Those of the example."""
FILES: Final = COMMON | EXAMPLE
SCHEMAS: Final[dict[str, Literal["task", "robot", "controllers"]]] = {
    "schemas/task.json": "task",
    "schemas/robot.json": "robot",
    "schemas/controllers.json": "controllers",
}
NO_ROBOT: Final = "it belongs to --robot"


def init(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="Folder of the project.")] = Path(),
    *,
    robot: Annotated[
        str | None,
        typer.Option("--robot", metavar="FILE", help="Set up this robot: a URDF or xacro file, or package://NAME/...."),
    ] = None,
    arg: Annotated[
        list[str] | None,
        typer.Option("--arg", metavar="NAME:=VALUE", help="Argument of the xacro file; repeatable."),
    ] = None,
    hand: Annotated[
        str | None,
        typer.Option("--hand", metavar="FILE", help="Attach this hand to it: another URDF or xacro file."),
    ] = None,
    hand_arg: Annotated[
        list[str] | None,
        typer.Option("--hand-arg", metavar="NAME:=VALUE", help="Argument of the hand's xacro file; repeatable."),
    ] = None,
    hand_at: Annotated[
        str | None,
        typer.Option("--hand-at", metavar="LINK", help="Link that carries the hand [default: the arm's last link]."),
    ] = None,
    hand_pose: Annotated[
        str | None,
        typer.Option(
            "--hand-pose",
            metavar="X,Y,Z[,R,P,Y]",
            help="Pose of the hand's root in that link: '0, 0, 45 mm, 0, 0, 90 deg' [default: the same frame].",
        ),
    ] = None,
    srdf: Annotated[
        Path | None,
        typer.Option("--srdf", metavar="FILE", help="Take groups, poses and touching links from this MoveIt SRDF."),
    ] = None,
    controllers: Annotated[
        Path | None,
        typer.Option(
            "--controllers", metavar="FILE", help="Use this controllers file (also of ROS) instead of a guess."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Create a small working project, of an example or of your own robot.

    A robot file, its controllers, a task with expectations, JSON schemas for editors and a workflow for GitHub Actions.
    With --robot, the arm, the hand, the tool frame, a start, missing limits and gains are guessed from the description,
    each with its evidence as a comment, and a task is searched whose run passes. An existing README.md or .gitignore is
    kept; if another of the files exists, nothing is written.
    """
    if robot is None:
        words = (("--arg", arg), ("--hand", hand), ("--srdf", srdf), ("--controllers", controllers))
        for word, value in words:
            if value:
                raise InvalidInput([Diagnostic("USE089", f"{word} has no effect: {NO_ROBOT}", hint="add --robot FILE")])
        write_files(folder, _common(folder) | _example() | _schemas() | _wheel(), force=force)
        _name(folder, "tasks/pick_place.yaml", (), allow_outside=allow_outside)
        _print_notes(folder)
        console.talk(f"next: {enter(folder)}manipcli test")
        return ExitCode.PASSED
    for word, value in (("--hand-arg", hand_arg), ("--hand-at", hand_at), ("--hand-pose", hand_pose)):
        if value and hand is None:
            raise InvalidInput(
                [Diagnostic("USE089", f"{word} has no effect: it belongs to --hand", hint="add --hand FILE")]
            )
    refuse_conflicts(folder, [*COMMON, "robot.yaml", "controllers.yaml", *SCHEMAS], force=force)
    from manipcli.onboard.onboard import Request, onboard
    from manipcli.onboard.source import HandSource

    pose = None if hand_pose is None else pose_numbers(hand_pose)
    request = Request(
        robot,
        folder,
        xacro_arguments(arg or []),
        package_path=tuple(package_path or ()),
        allow_outside=allow_outside,
        srdf=srdf,
        controllers=controllers,
        hand=None if hand is None else HandSource(hand, xacro_arguments(hand_arg or []), hand_at, pose),
    )
    live = console.is_live()
    made = onboard(request, on_progress=lambda what: console.redraw(what) if live else None)
    if live:
        console.redraw("")
    own = {name: text.encode() for name, text in made.files.items()}
    common = _common(folder, robot="robot.yaml", task=made.task_file)
    write_files(folder, common | own | _schemas() | _wheel(), force=force)
    _name(folder, made.task_file, tuple(package_path or ()), allow_outside=allow_outside)
    console.result("")
    for line in made.summary:
        console.result(line)
    _print_notes(folder)
    options = " --allow-outside" * allow_outside
    console.talk(f"next: {enter(folder)}manipcli run {made.task_file}{options}")
    return ExitCode.PASSED if made.passed else ExitCode.FAILED


def _common(folder: Path, *, robot: str = "robots/panda.yaml", task: str = "tasks/pick_place.yaml") -> dict[str, bytes]:
    """README, .gitignore and workflow."""
    name = (Path(os.path.realpath(folder)).name or "tasks").encode("utf-8", "replace")
    found = _installation()
    words = {
        b"INSTALL": found.requirement.encode() if found is not None else b"",
        b"CONTROLLERS": re.sub("^robots?", "controllers", robot).encode(),
        b"ROBOT": robot.encode(),
        b"TASK": Path(task).stem.encode(),
        b"PROJECT": name,
    }
    files = {path: (TEMPLATES / template).read_bytes() for path, template in COMMON.items()}
    if found is None:
        del files[WORKFLOW]
        rows = files["README.md"].splitlines(keepends=True)
        files["README.md"] = b"".join(row for row in rows if WORKFLOW.encode() not in row)
    pattern = re.compile(b"|".join(words))
    return {path: pattern.sub(lambda match: words[match[0]], data) for path, data in files.items()}


def _print_notes(folder: Path) -> None:
    for note in notes(folder, workflow=_installation() is not None):
        console.talk(f"note: {note}")


@cache
def _installation() -> Installation | None:
    from manipcli.cli.own_wheel import installation

    return installation()


def _wheel() -> dict[str, bytes]:
    """The wheel that the workflow installs, if it needs one."""
    found = _installation()
    return {} if found is None or found.wheel is None else dict([found.wheel])


def _example() -> dict[str, bytes]:
    return {path: (TEMPLATES / template).read_bytes() for path, template in EXAMPLE.items()}


def _schemas() -> dict[str, bytes]:
    from manipcli import pipeline
    from manipcli.report.json import dumps

    return {path: f"{dumps(pipeline.schema(kind))}\n".encode() for path, kind in SCHEMAS.items()}


def _name(folder: Path, task: str, package_path: tuple[Path, ...], *, allow_outside: bool) -> None:
    """Adds the names of the task to the schema that it names."""
    from manipcli import pipeline

    pipeline.updated_schema(folder / task, folder=folder, package_path=package_path, allow_outside=allow_outside)
