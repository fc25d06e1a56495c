"""`manipcli list [KIND [TASK]]`: files below this folder, words that files may use, the controllers of a task."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, get_args

import typer

from manipcli.cli import console
from manipcli.cli.options import Format, OutputFormat
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

Kind = Literal["robots", "tasks", "controllers", "steps", "expectations", "conditions", "shapes", "engines", "checks"]
FILES = {"robots": "robot", "tasks": "task", "controllers": "controllers"}
"""Kinds that are files, each with the kind of one such file."""


def list_(
    kind: Annotated[
        Kind | None, typer.Argument(metavar="KIND", help="What to list [default: all].", show_default=False)
    ] = None,
    task: Annotated[
        Path | None,
        typer.Argument(metavar="TASK", help="With `controllers`: list those of this task.", show_default=False),
    ] = None,
    *,
    format_: Format = "text",
) -> ExitCode:
    """List files, and the words they may use.

    Robots, tasks and controllers are files below this folder, checks are the codes of `check-urdf`; the rest are words
    of task files. `list controllers TASK` shows the interfaces that each controller claims at the start of a task.
    """
    from manipcli import pipeline
    from manipcli.report.json import dumps
    from manipcli.report.table import table

    if task is not None:
        return _controllers(kind, task, format_)
    if kind == "checks" and format_ == "text":
        from manipcli.description.lint.checks import CHECKS
        from manipcli.report.description import render_checks

        console.result(render_checks(CHECKS))
        return ExitCode.PASSED
    found = {each: _names(each) for each in (get_args(Kind) if kind is None else (kind,))}
    if format_ == "json":
        console.result(dumps(found))
    elif kind is not None:
        if meanings := pipeline.meanings(kind):
            console.result(table(("word", "meaning"), [*meanings.items()]))
            return ExitCode.PASSED
        for name in found[kind]:
            console.result(name)
    else:
        for each, names in found.items():
            console.result(f"{each}: {', '.join(names) or '-'}")
    return ExitCode.PASSED


def _controllers(kind: Kind | None, task: Path, format_: OutputFormat) -> ExitCode:
    from manipcli import pipeline
    from manipcli.report.controllers import render_json, render_text

    if kind != "controllers":
        message = f"`list {kind}` does not take a file; only `list controllers TASK` does"
        raise InvalidInput([Diagnostic("USE058", message)])
    rows = pipeline.controllers_of(task)
    console.result(render_json(str(task), rows) if format_ == "json" else render_text(rows))
    return ExitCode.PASSED


def _names(kind: str) -> tuple[str, ...]:
    from manipcli import pipeline

    if kind in FILES:
        return tuple(str(path) for path in _yaml_files(Path()) if pipeline.kind_of(path) == FILES[kind])
    return pipeline.words(kind)


def _yaml_files(folder: Path) -> list[Path]:
    """The YAML files below `folder`, sorted by path; hidden folders are not entered."""
    return sorted(
        path
        for path in folder.rglob("*.y*ml")
        if path.suffix.lower() in (".yaml", ".yml") and not any(part.startswith(".") for part in path.parts)
    )
