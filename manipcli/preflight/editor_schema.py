"""The JSON Schema that a task file names for editors, kept current with the names of the task.

    # yaml-language-server: $schema=../schemas/task.json

Only a schema of tasks by manipcli is replaced: the file is read first. It must exist, end in `.json` and be in the
project of the task.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from manipcli.core.errors import InvalidInput
from manipcli.core.text import escape
from manipcli.core.whole_file import write_whole
from manipcli.description.packages import is_shared
from manipcli.preflight.check_files import schema
from manipcli.task.task_files import MARKS

_MODELINE: Final = re.compile(r"#\s*yaml-language-server\s*:\s*\$schema\s*=\s*(\S+)\s*")
FIRST_LINES: Final = 20
"""Lines of a file in which a modeline is searched."""
MOST_BYTES: Final = 20_000_000
TITLE: Final = "manipcli task"


def modeline(text: str) -> str | None:
    """The schema that a file names in its first lines; None without."""
    found = (_MODELINE.fullmatch(line.strip()) for line in text.splitlines()[:FIRST_LINES])
    return next((match.group(1) for match in found if match is not None), None)


def schema_file(task: Path, *, folder: Path) -> tuple[Path | None, str]:
    """The schema that the task names and that may be replaced; else None and why not, "" where it names none.

    Args:
        task: the task file.
        folder: the working directory: a project too, if the task is in it.
    """
    try:
        name = modeline(task.read_text("utf-8", "replace"))
        if name is None:
            return None, ""
        if "://" in name or not name.endswith(".json"):
            return None, f"the schema '{escape(name)}' is not a local .json file"
        file = (task.parent / name).resolve()
        if not any(file.is_relative_to(project) for project in _projects(task.resolve(), folder.resolve())):
            return None, f"the schema '{escape(name)}' is outside the project of the task"
        if not file.is_file():
            how = f"write it with `manipcli schema task --for {escape(str(task))} > {escape(str(file))}`"
            return None, f"there is no schema '{escape(name)}': {how}"
        if file.stat().st_size > MOST_BYTES or not _is_task_schema(json.loads(file.read_bytes())):
            return None, f"'{escape(name)}' is not a schema of tasks by manipcli; it is left as it is"
    except ValueError:
        return None, f"'{escape(str(name))}' is not a schema of tasks by manipcli; it is left as it is"
    except (OSError, RecursionError) as error:
        return None, f"the schema of '{escape(str(task))}' cannot be read: {error}"
    return file, ""


@dataclass(frozen=True, slots=True)
class SchemaUpdate:
    """The schema that a task names (None: none that may be replaced), whether it changed, and why it could not; ""."""

    file: Path | None
    written: bool = False
    why_not: str = ""


def updated_schema(
    task: Path,
    *,
    folder: Path,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    leave: Collection[Path] = (),
) -> SchemaUpdate:
    """Writes the schema that the task names with the names of this task; those in `leave` have been written."""
    file, why_not = schema_file(task, folder=folder)
    if file is None or file in leave:
        return SchemaUpdate(file, why_not=why_not)
    try:
        found = schema("task", task=task, package_path=package_path, allow_outside=allow_outside)
        data = f"{json.dumps(found, indent=2, ensure_ascii=False)}\n".encode()
        if data == file.read_bytes():
            return SchemaUpdate(file)
        write_whole(file, data)
    except InvalidInput:
        return SchemaUpdate(file)  # its findings say why
    except OSError as error:
        return SchemaUpdate(file, why_not=f"the schema '{file}' cannot be written: {error.strerror or error}")
    return SchemaUpdate(file, written=True)


def _is_task_schema(found: object) -> bool:
    if not isinstance(found, dict) or not isinstance(found.get("properties"), dict):
        return False
    return str(found.get("title", "")) == TITLE and {"task", "steps"} <= {*found["properties"]}


def _projects(task: Path, folder: Path) -> list[Path]:
    """The folder of the task, the nearest folder above with a mark of a project, and the working directory."""
    marked = next((above for above in task.parents if any((above / mark).exists() for mark in MARKS)), None)
    around = [above for above in (marked, folder) if above is not None and task.is_relative_to(above)]
    return [task.parent, *(above for above in around if not is_shared(above))]
