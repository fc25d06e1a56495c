"""Options that several commands share, each said once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from manipcli.core.errors import Diagnostic, InvalidInput

OutputFormat = Literal["text", "json"]

Format = Annotated[OutputFormat, typer.Option("--format", help="Text for people, or one JSON object on stdout.")]
TaskFile = Annotated[Path, typer.Argument(metavar="TASK", help="The task file.", show_default=False)]
XacroArguments = Annotated[
    list[str] | None,
    typer.Argument(metavar="[NAME:=VALUE]...", help="Arguments of a xacro file.", show_default=False),
]
LogFile = Annotated[Path, typer.Argument(metavar="LOG", help="An .mcap file.", show_default=False)]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="A.B=VALUE",
        help="Set any field of the task, or robot.A.B, controllers.A.B; repeatable.",
        show_default=False,
    ),
]
Seed = Annotated[
    int | None,
    typer.Option("--seed", metavar="N", min=0, help="Seed of the planner and of samples; the task's when absent."),
]
Sample = Annotated[
    int | None,
    typer.Option(
        "--sample", metavar="N", min=0, help="Sample N of the task's `vary:`; the task as written when absent."
    ),
]
PackagePath = Annotated[
    list[Path] | None,
    typer.Option("--package-path", metavar="DIR", help="A further place to look for packages; repeatable."),
]
AllowOutside = Annotated[
    bool, typer.Option("--allow-outside", help="Let a file lie outside the folders of its packages.")
]

PagePort = Annotated[
    int | None,
    typer.Option("--port", metavar="N", min=0, max=65535, help="Port [default: the first free one from 8080]."),
]
OpenPage = Annotated[bool, typer.Option("--open", help="Open the page in a browser.")]


def seconds(word: str) -> float:
    """A time as it is written on a command line: a number of seconds, or a number and a unit of time.

    Raises:
        InvalidInput: it is none.
    """
    from manipcli.core.units import TIME, UnitError, to_si

    try:
        value = float(word) if word.strip()[-1:].isdecimal() else to_si(word, TIME)
    except (ValueError, UnitError) as error:
        message = error.cause if isinstance(error, UnitError) else f"'{word}' is no time"
        raise InvalidInput([Diagnostic("USE050", message, hint="write 3.2, '3.2 s' or 250ms")]) from error
    return value


def hertz(word: str) -> float:
    """A frequency as it is written on a command line: a number of hertz, or a number and a unit of frequency.

    Raises:
        InvalidInput: it is none, or not above 0.
    """
    from manipcli.core.units import FREQUENCY, UnitError, to_si

    try:
        value = float(word) if word.strip()[-1:].isdecimal() else to_si(word, FREQUENCY)
    except (ValueError, UnitError) as error:
        message = error.cause if isinstance(error, UnitError) else f"'{word}' is no frequency"
        raise InvalidInput([Diagnostic("USE072", message, hint="write 5, '5 Hz' or 0.5kHz")]) from error
    if not 0.0 < value < 1e9:
        raise InvalidInput([Diagnostic("USE072", f"'{word}' is no frequency above 0")])
    return value


def xacro_arguments(words: list[str]) -> dict[str, str]:
    """`NAME:=VALUE` words by name.

    Raises:
        InvalidInput: a word that is none.
    """
    found = {}
    for word in words:
        name, mark, value = word.partition(":=")
        if not mark or not name:
            message = f"'{word}' is no argument of a description; expected NAME:=VALUE"
            raise InvalidInput([Diagnostic("USE045", message)])
        found[name] = value
    return found
