"""`manipcli list [KIND]`: the files below this folder, and the words that files may use."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, get_args

import typer

from manipcli.cli import console
from manipcli.cli.options import Format
from manipcli.core.errors import ExitCode

Kind = Literal["robots", "tasks", "controllers", "steps", "expectations", "conditions", "shapes", "engines", "checks"]
FILES = {"robots": "robot", "tasks": "task", "controllers": "controllers"}
"""The kinds that are files, and the word for one such file."""


def list_(
    kind: Annotated[
        Kind | None, typer.Argument(metavar="KIND", help="Which; all when absent.", show_default=False)
    ] = None,
    *,
    format_: Format = "text",
) -> ExitCode:
    """List files and the words they may use.

    Robots, tasks and controllers are files below this folder; the rest are words of task files.
    """
    from manipcli.report.json import dumps

    if kind == "checks" and format_ == "text":
        from manipcli.model.checks import CHECKS
        from manipcli.report.description import render_checks

        console.result(render_checks(CHECKS))
        return ExitCode.PASSED
    found = {one: _names(one) for one in (get_args(Kind) if kind is None else (kind,))}
    if format_ == "json":
        console.result(dumps(found))
    elif kind is not None:
        for name in found[kind]:
            console.result(name)
    else:
        for one, names in found.items():
            console.result(f"{one}: {', '.join(names) or '-'}")
    return ExitCode.PASSED


def _names(kind: str) -> tuple[str, ...]:
    from manipcli import pipeline

    if kind in FILES:
        return tuple(str(path) for path in _yaml_files(Path()) if pipeline.kind_of(path) == FILES[kind])
    return pipeline.words(kind)


def _yaml_files(folder: Path) -> list[Path]:
    """The YAML files below `folder`, in the order of their names; hidden folders are not entered."""
    return sorted(
        path
        for path in folder.rglob("*.y*ml")
        if path.suffix in (".yaml", ".yml") and not any(part.startswith(".") for part in path.parts)
    )
