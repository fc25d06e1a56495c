"""`manipcli schema KIND`: the JSON Schema of a kind of file, for editors and as the reference manual."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from manipcli.cli import console
from manipcli.core.errors import ExitCode


def schema(
    kind: Annotated[
        Literal["task", "robot", "controllers"], typer.Argument(metavar="KIND", help="The kind of file.")
    ] = "task",
) -> ExitCode:
    """Print the JSON Schema of a kind of file.

    It says which keys there are, and types, limits and plain units of values; `check` finds everything, as unknown
    names and what is computed. Controllers files in a form of ROS have no schema.
    """
    from manipcli import pipeline
    from manipcli.report.json import dumps

    console.result(dumps(pipeline.schema(kind)))
    return ExitCode.PASSED
