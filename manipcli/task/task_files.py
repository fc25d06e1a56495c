"""Where a task may read its sub-tasks and fragments."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from manipcli.core.text import escape
from manipcli.description.packages import LEVELS_ABOVE, NotFound, Outside, Packages, is_shared
from manipcli.spec.structure.files import Find, Refused

MARKS: Final = ("pyproject.toml", "manipcli.toml", "package.xml", ".git")
"""Files of a project's top folder."""


def finder(task: Path, *, package_path: Sequence[Path] = (), allow_outside: bool = False) -> Find:
    """Finds files in the folder of the task and below, in its project, and in the given packages.

    Symbolic links are resolved first. The project is the nearest folder above with one of `MARKS`; the home folder and
    folders of several users are none.

    Args:
        task: the task file.
        package_path: more folders.
        allow_outside: permits files anywhere.
    """
    real = Path(os.path.realpath(task))
    above = real.parents[: LEVELS_ABOVE + 1]
    project = next((folder for folder in above if any((folder / mark).exists() for mark in MARKS)), None)
    folders = [] if project is None or is_shared(project) else [project]
    packages = Packages(task, package_path=(*package_path, *folders), allow_outside=allow_outside)

    def find(name: str, base: Path) -> Path:
        try:
            return packages.resolve(name, relative_to=base.parent)
        except Outside:
            hint = "move it there, add its folder with --package-path DIR, or pass --allow-outside"
            raise Refused(f"'{escape(name)}' is outside the folder and the project of the task", hint) from None
        except NotFound as error:
            raise Refused(error.message, error.hint) from None

    return find
