"""`manipcli schema KIND`: the JSON Schema of a kind of file, for editors and as a reference."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from manipcli.cli import console
from manipcli.core.errors import ExitCode


def schema(
    kind: Annotated[
        Literal["task", "robot", "controllers"], typer.Argument(metavar="KIND", help="Kind of file.")
    ] = "task",
) -> ExitCode:
    """Print the JSON Schema of a kind of file.

    It has keys, types, limits and simple units; `check` also finds unknown names and invalid computed values.
    Controllers files in ROS form have no schema.
    """
    from manipcli import pipeline
    from manipcli.report.json import dumps

    console.result(dumps(pipeline.schema(kind)))
    return ExitCode.PASSED
