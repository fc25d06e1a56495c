"""`manipcli init [DIR]`: a small project that works: a robot, its controllers, a task, and how CI runs it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from shlex import quote
from typing import Annotated, Final

import typer

from manipcli.cli import console
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.text import listed

TEMPLATES: Final = Path(__file__).parents[1] / "project"
FILES: Final = {
    "README.md": "README.md",
    ".gitignore": "gitignore",
    ".github/workflows/manipcli.yml": "github/workflows/manipcli.yml",
    "tasks/pick_place.yaml": "tasks/pick_place.yaml",
    "robots/panda.yaml": "robots/panda.yaml",
    "controllers/panda.yaml": "controllers/panda.yaml",
}
"""What is written, and from which template."""
MAY_BE_THERE: Final = ("README.md", ".gitignore")
"""What a folder has before it is a project: kept as it is."""
RESULTS: Final = ("runs", "report")
"""Folders that no repository should hold."""


def init(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="Where; this folder when absent.")] = Path(),
    *,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
) -> ExitCode:
    """Write a small project that works.

    A robot whose description comes with PyBullet, its controllers, a task with expectations, JSON schemas for editors
    and a workflow for GitHub Actions. A README.md and a .gitignore that are there are kept; nothing is written where
    another of the files is there already.
    """
    files = _files(folder)
    kept = [] if force else [path for name in MAY_BE_THERE if os.path.lexists(path := folder / name)]
    there = [] if force else [str(path) for path in files if path not in kept and os.path.lexists(path)]
    if there:
        are = "is" if len(there) == 1 else "are"
        message = f"{listed(there)} {are} there already; nothing was written"
        raise InvalidInput(
            [Diagnostic("USE088", message, hint="give another folder, or --force to replace what is there")]
        )
    wrong = sorted({told for path in files if path not in kept for told in _in_the_way(path)})
    if wrong:
        raise InvalidInput([Diagnostic("USE088", f"{listed(wrong)}; nothing was written", hint="give another folder")])
    from manipcli.core.whole_file import write_whole

    for path, data in files.items():
        if path in kept:
            console.result(f"kept: {path}")
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, data)
        console.result(f"written: {path}")
    for note in (*_unignored(folder / ".gitignore"), *_not_at_the_top(folder)):
        console.talk(f"note: {note}")
    name = f"./{folder}" if str(folder).startswith("-") else str(folder)
    enter = "" if Path(os.path.realpath(folder)) == Path.cwd() else f"cd {quote(name)} && "
    console.talk(f"next: {enter}manipcli test")
    return ExitCode.PASSED


def _unignored(file: Path) -> Iterator[str]:
    """What a .gitignore that was kept lacks."""
    if not file.is_file():  # a link to nothing was kept
        return
    known = {line.strip().strip("/") for line in file.read_text("utf-8", "replace").splitlines()}
    lacking = [f"`{name}/`" for name in RESULTS if name not in known]
    if lacking:
        yield f"{file} has no {listed(lacking)}: git would take logs and reports of runs for files of yours"


def _not_at_the_top(folder: Path) -> Iterator[str]:
    """That GitHub does not see the workflow."""
    whole = Path(os.path.realpath(folder))
    top = next((place for place in (whole, *whole.parents) if (place / ".git").exists()), whole)
    if top != whole:
        workflow = Path(".github", "workflows", "manipcli.yml")
        yield (
            f"GitHub runs workflows at the top of a repository alone: move {folder / workflow} to {top / workflow}, "
            f"begin its job with `defaults: {{run: {{working-directory: {whole.relative_to(top)}}}}}`, "
            "and the paths of its artifact with that folder"
        )


def _in_the_way(path: Path) -> Iterator[str]:
    """What makes it impossible to write a file there, as far as can be seen."""
    if path.is_dir():
        yield f"'{path}' is a folder where a file is to be"
    for parent in path.parents:
        if os.path.lexists(parent) and not parent.is_dir():
            yield f"'{parent}' is a file where a folder is to be"


def _files(folder: Path) -> dict[Path, bytes]:
    """Every file of the project, by its path."""
    from manipcli import pipeline
    from manipcli.report.json import dumps

    name = (Path(os.path.realpath(folder)).name or "tasks").encode("utf-8", "replace")
    files = {
        folder / path: (TEMPLATES / template).read_bytes().replace(b"PROJECT", name) for path, template in FILES.items()
    }
    schemas = {
        folder / "schemas" / f"{kind}.json": f"{dumps(pipeline.schema(kind))}\n".encode()
        for kind in ("task", "robot", "controllers")
    }
    return files | schemas
