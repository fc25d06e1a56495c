"""Writing of the files of a new project: never over existing ones, unless that is asked for."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from shlex import quote
from typing import Final

from manipcli.cli import console
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import listed

MAY_BE_THERE: Final = ("README.md", ".gitignore")
"""Existing files that are kept."""
RESULTS: Final = ("runs", "report")
"""Folders that belong in .gitignore."""


def refuse_conflicts(folder: Path, names: Iterable[str], *, force: bool) -> None:
    """Check that the files `names` can be written into a folder.

    Raises:
        InvalidInput: one exists and is not replaced, or a folder or a file is in the way.
    """
    paths = [folder / name for name in names]
    kept = [] if force else [path for name in MAY_BE_THERE if os.path.lexists(path := folder / name)]
    there = [] if force else [str(path) for path in paths if path not in kept and os.path.lexists(path)]
    if there:
        verb = "exists" if len(there) == 1 else "exist"
        message = f"{listed(there)} already {verb}; nothing was written"
        raise InvalidInput([Diagnostic("USE088", message, hint="name another folder, or add --force to replace them")])
    wrong = sorted({conflict for path in paths if path not in kept for conflict in _in_the_way(path)})
    if wrong:
        raise InvalidInput([Diagnostic("USE088", f"{listed(wrong)}; nothing was written", hint="name another folder")])


def write_files(folder: Path, files: Mapping[str, bytes], *, force: bool) -> None:
    """Writes files into a folder and lists them.

    Raises:
        InvalidInput: see `refuse_conflicts`; nothing was written.
    """
    refuse_conflicts(folder, files, force=force)
    from manipcli.core.whole_file import write_whole

    for name, data in files.items():
        path = folder / name
        if not force and name in MAY_BE_THERE and os.path.lexists(path):
            console.result(f"kept: {path}")
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, data)
        console.result(f"written: {path}")


def notes(folder: Path, *, workflow: bool) -> Iterator[str]:
    """Notes on the folder of a written project; `workflow`: whether it has one."""
    yield from _unignored(folder / ".gitignore")
    if workflow:
        yield from _not_at_the_top(folder)
    else:
        yield (
            "no workflow for GitHub Actions is written: manipcli runs without being installed, so what its jobs would "
            "install is unknown; install manipcli with pip and repeat with --force"
        )


def enter(folder: Path) -> str:
    """The command that changes to a folder, with ` && `; "" for the working directory."""
    name = f"./{folder}" if str(folder).startswith("-") else str(folder)
    return "" if Path(os.path.realpath(folder)) == Path.cwd() else f"cd {quote(name)} && "


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
