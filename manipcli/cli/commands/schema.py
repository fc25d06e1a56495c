"""`manipcli schema KIND`: the JSON Schema of a kind of file, for editors and as a reference."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, PackagePath
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput


def schema(
    kind: Annotated[
        Literal["task", "robot", "controllers"], typer.Argument(metavar="KIND", help="Kind of file.")
    ] = "task",
    *,
    task: Annotated[
        Path | None,
        typer.Option("--for", metavar="TASK", help="List the names of this task: bodies, joints, poses, steps, ..."),
    ] = None,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Print the JSON Schema of a kind of file.

    It has keys, types, limits and simple units; with --for also the names of a task, so that an editor completes them.
    `check` also finds invalid computed values.
    Controllers files in ROS form have no schema.
    """
    from manipcli import pipeline
    from manipcli.report.json import dumps

    if task is not None and kind != "task":
        message = f"--for needs the kind `task`, not `{kind}`"
        raise InvalidInput([Diagnostic("USE095", message, hint="write `manipcli schema task --for TASK`")])
    schema_ = pipeline.schema(kind, task=task, package_path=tuple(package_path or ()), allow_outside=allow_outside)
    console.result(dumps(schema_))
    return ExitCode.PASSED
