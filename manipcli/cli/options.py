"""Options that several commands share, each said once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

OutputFormat = Literal["text", "json"]

Format = Annotated[OutputFormat, typer.Option("--format", help="Text for people, or one JSON object on stdout.")]
TaskFile = Annotated[Path, typer.Argument(metavar="TASK", help="The task file.", show_default=False)]
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
    typer.Option("--seed", metavar="N", min=0, help="Seed of planner and noise; the task's when absent."),
]
PackagePath = Annotated[
    list[Path] | None,
    typer.Option("--package-path", metavar="DIR", help="A further place to look for packages; repeatable."),
]
AllowOutside = Annotated[
    bool, typer.Option("--allow-outside", help="Let a file lie outside the folders of its packages.")
]
