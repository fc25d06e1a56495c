"""Options that several commands share, and the parsing of their values."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from manipcli.cli.log_files import opened
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import number_of

OutputFormat = Literal["text", "json"]

Format = Annotated[OutputFormat, typer.Option("--format", help="Output format; json is one object on stdout.")]
TaskFile = Annotated[Path, typer.Argument(metavar="TASK", help="Task file.", show_default=False)]
XacroArguments = Annotated[
    list[str] | None,
    typer.Argument(metavar="[NAME:=VALUE]...", help="Arguments of the xacro file.", show_default=False),
]
LogFile = Annotated[
    Path,
    typer.Argument(metavar="LOG", help="MCAP file, or the folder of a rosbag2.", show_default=False, callback=opened),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="A.B=VALUE",
        help="Override a field of the task, or robot.A.B, controllers.A.B; repeatable.",
        show_default=False,
    ),
]
Seed = Annotated[
    int | None,
    typer.Option("--seed", metavar="N", min=0, help="Seed of the planner and of samples [default: the task's]."),
]
Sample = Annotated[
    int | None,
    typer.Option(
        "--sample", metavar="N", min=0, help="Use sample N of the task's `vary:` [default: the task as written]."
    ),
]
Design = Annotated[
    str,
    typer.Option(
        "--design", metavar="NAME:N", help="Take --sample from this design of N points, sobol:256 [default: random]."
    ),
]
PackagePath = Annotated[
    list[Path] | None,
    typer.Option("--package-path", metavar="DIR", help="Search DIR for packages, too; repeatable."),
]
AllowOutside = Annotated[
    bool, typer.Option("--allow-outside", help="Allow files outside the folders of their packages.")
]

PagePort = Annotated[
    int | None,
    typer.Option(
        "--port", metavar="N", min=0, max=65535, help="Port of the page [default: first free port from 8080]."
    ),
]
OpenPage = Annotated[bool, typer.Option("--open", help="Open the page in a browser.")]


def check_design(design: str, sample: int | None) -> None:
    """
    Raises:
        InvalidInput: a design without a sample.
    """
    if design and sample is None:
        message = f"--design {design} needs --sample N"
        raise InvalidInput([Diagnostic("USE180", message, hint="name the sample, or run all with `manipcli sweep`")])


def cores() -> int:
    """Number of cores that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    else:
        return os.cpu_count() or 1


def seconds(word: str) -> float:
    """[s] A time on the command line: a number of seconds, or a number and a unit of time.

    Raises:
        InvalidInput: it is not a time.
    """
    from manipcli.core.units import TIME, UnitError, to_si

    try:
        value = float(word) if word.strip()[-1:].isdecimal() else to_si(word, TIME)
    except (ValueError, UnitError) as error:
        message = error.cause if isinstance(error, UnitError) else f"'{word}' is not a time"
        raise InvalidInput([Diagnostic("USE050", message, hint="write 3.2, '3.2 s' or 250ms")]) from error
    return value


def hertz(word: str) -> float:
    """[Hz] A frequency on the command line: a number of hertz, or a number and a unit of frequency.

    Raises:
        InvalidInput: it is not a frequency, or not above 0.
    """
    from manipcli.core.units import FREQUENCY, UnitError, to_si

    try:
        value = float(word) if word.strip()[-1:].isdecimal() else to_si(word, FREQUENCY)
    except (ValueError, UnitError) as error:
        message = error.cause if isinstance(error, UnitError) else f"'{word}' is not a frequency"
        raise InvalidInput([Diagnostic("USE072", message, hint="write 5, '5 Hz' or 0.5kHz")]) from error
    if not 0.0 < value < 1e9:
        raise InvalidInput([Diagnostic("USE072", f"'{word}' is not a frequency above 0 and below 1 GHz")])
    return value


def pose_numbers(word: str) -> tuple[float, ...]:
    """x, y, z [m], or these and roll, pitch, yaw [rad], of a pose on the command line.

    Raises:
        InvalidInput: it is not a pose.
    """
    from manipcli.core.units import ANGLE, LENGTH, UnitError, to_si

    parts = [part.strip() for part in word.split(",")]
    hint = "write x, y, z, or x, y, z, roll, pitch, yaw: '0, 0, 45 mm' or '0, 0, 0.045, 0, 0, 90 deg'"
    if len(parts) not in (3, 6):
        message = f"'{word}' is not a pose: {number_of(len(parts), 'value')}"
        raise InvalidInput([Diagnostic("INIT003", message, hint=hint)])
    found = []
    for k, part in enumerate(parts):
        try:
            value = float(part) if part[-1:].isdecimal() else to_si(part, ANGLE if k >= 3 else LENGTH)
        except (ValueError, UnitError) as error:
            cause = error.cause if isinstance(error, UnitError) else f"'{part}' is not a number"
            raise InvalidInput([Diagnostic("INIT003", f"'{word}' is not a pose: {cause}", hint=hint)]) from error
        if not math.isfinite(value):
            raise InvalidInput([Diagnostic("INIT003", f"'{word}' is not a pose: '{part}' is not finite", hint=hint)])
        found.append(value)
    return tuple(found)


def xacro_arguments(words: list[str]) -> dict[str, str]:
    """Values of `NAME:=VALUE` words, by name.

    Raises:
        InvalidInput: a word has another form.
    """
    found = {}
    for word in words:
        name, mark, value = word.partition(":=")
        if not mark or not name:
            message = f"'{word}' is not a xacro argument; expected NAME:=VALUE"
            raise InvalidInput([Diagnostic("USE045", message)])
        found[name] = value
    return found
