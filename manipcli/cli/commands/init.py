"""`manipcli init [DIR]`: a small working project: a robot, its controllers, a task, and a CI workflow."""

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
"""Written files, each with its template."""
MAY_BE_THERE: Final = ("README.md", ".gitignore")
"""Existing files that are kept."""
RESULTS: Final = ("runs", "report")
"""Folders that belong in .gitignore."""


def init(
    folder: Annotated[Path, typer.Argument(metavar="[DIR]", help="Folder of the project.")] = Path(),
    *,
    force: Annotated[bool, typer.Option("--force", help="Replace existing files.")] = False,
) -> ExitCode:
    """Create a small working project.

    A robot whose description comes with PyBullet, its controllers, a task with expectations, JSON schemas for editors
    and a workflow for GitHub Actions. An existing README.md or .gitignore is kept; if another of the files exists,
    nothing is written.
    """
    files = _files(folder)
    kept = [] if force else [path for name in MAY_BE_THERE if os.path.lexists(path := folder / name)]
    there = [] if force else [str(path) for path in files if path not in kept and os.path.lexists(path)]
    if there:
        verb = "exists" if len(there) == 1 else "exist"
        message = f"{listed(there)} already {verb}; nothing was written"
        raise InvalidInput([Diagnostic("USE088", message, hint="name another folder, or add --force to replace them")])
    wrong = sorted({conflict for path in files if path not in kept for conflict in _in_the_way(path)})
    if wrong:
        raise InvalidInput([Diagnostic("USE088", f"{listed(wrong)}; nothing was written", hint="name another folder")])
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
    """What is missing in a .gitignore that was kept."""
    if not file.is_file():  # a link to nothing was kept
        return
    known = {line.strip().strip("/") for line in file.read_text("utf-8", "replace").splitlines()}
    lacking = [f"`{name}/`" for name in RESULTS if name not in known]
    if lacking:
        yield f"{file} lacks {listed(lacking)}: add it, or git shows logs and reports as untracked files"


def _not_at_the_top(folder: Path) -> Iterator[str]:
    """A note where the project is not at the top of its repository: GitHub does not see its workflow."""
    whole = Path(os.path.realpath(folder))
    top = next((place for place in (whole, *whole.parents) if (place / ".git").exists()), whole)
    if top != whole:
        workflow = Path(".github", "workflows", "manipcli.yml")
        yield (
            f"GitHub runs workflows only from the top of a repository: move {folder / workflow} to {top / workflow}, "
            f"add to its job `defaults: {{run: {{working-directory: {whole.relative_to(top)}}}}}`, "
            "and prefix the paths of its artifact with that folder"
        )


def _in_the_way(path: Path) -> Iterator[str]:
    """Files and folders that prevent writing `path`."""
    if path.is_dir():
        yield f"'{path}' is a folder; expected a file"
    for parent in path.parents:
        if os.path.lexists(parent) and not parent.is_dir():
            yield f"'{parent}' is a file; expected a folder"


def _files(folder: Path) -> dict[Path, bytes]:
    """Contents of every file of the project, by path."""
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
