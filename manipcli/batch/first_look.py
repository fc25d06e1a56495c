"""Whether a file is worth reading as a task. Asked of any file of anybody: nothing else of ours is imported here."""

from __future__ import annotations

import re
from pathlib import Path

SUFFIXES = (".yaml", ".yml")
SNIFFED = 65536
"""Bytes of a file in which `task:` is looked for: nothing else of foreign files is read."""
NOT_ENTERED = frozenset({"runs", "build", "dist", "node_modules", "site-packages", "__pycache__"})
"""Folders that hold results and what others wrote; as well as hidden ones and virtual environments."""
_TASK = re.compile(rb"""(?:^|\A\s*\{\s*)(["']?)task\1[ \t]*:[ \t]+[^\s#]""", re.MULTILINE)


def looks_like_a_task(path: Path) -> bool:
    """Whether a file begins like a task: by its name and its first bytes, so that any file may be asked about."""
    if path.suffix not in SUFFIXES or path.name.startswith("."):
        return False
    try:
        if not path.is_file():  # opening a pipe would wait for who writes into it
            return False
        with path.open("rb") as file:
            return _TASK.search(file.read(SNIFFED).removeprefix(b"\xef\xbb\xbf")) is not None
    except OSError:
        return False


def is_entered(folder: Path) -> bool:
    """Whether tasks are looked for in a folder that nobody named."""
    return not (folder.name.startswith(".") or folder.name in NOT_ENTERED or (folder / "pyvenv.cfg").exists())
