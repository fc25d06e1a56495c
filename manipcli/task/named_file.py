"""The robot and controllers files that a task names."""

from __future__ import annotations

import os
from pathlib import Path

from manipcli.core.errors import InvalidInput
from manipcli.spec.load import sibling
from manipcli.spec.located import Located
from manipcli.spec.task import TaskSpec


def named_file(task: Located[TaskSpec], path: Path, key: str) -> Path:
    """The file that the task at `path` names under `key`.

    Raises:
        InvalidInput: the file does not exist; the place is where it is named.
    """
    named: str = getattr(task.spec, key)
    found = Path(os.path.normpath(path.parent / named))
    if found.is_file():
        return found
    if found.is_dir():
        message, hint = f"'{found}' is a folder; expected a YAML file", "name the YAML file in it"
    elif found.exists():
        message, hint = f"'{found}' is not a regular file; expected a YAML file", None
    else:
        message, hint = f"there is no file '{found}'", sibling(found)
    raise InvalidInput([task.source.finding(231, (key,), message, hint=hint)])
