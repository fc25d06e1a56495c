"""Whether a file is worth reading as a task. Asked of any file of anybody: nothing else of ours is imported here."""

from __future__ import annotations

import re
from pathlib import Path

SUFFIXES = (".yaml", ".yml")
SNIFFED = 65536
"""Bytes of a file in which keys are looked for: nothing else of foreign files is read."""
NOT_ENTERED = frozenset({"runs", "build", "dist", "node_modules", "site-packages", "__pycache__"})
"""Folders that hold results and what others wrote; as well as hidden ones and virtual environments."""
_KEY = rb"""(?:^|\A\s*\{(?s:.*[,{])?\s*)(["']?)%b\1[ \t]*:(?=\s)"""
_TASK, _ROBOT = (re.compile(_KEY % key, re.MULTILINE) for key in (b"task", b"robot"))
_NAME = re.compile(rb"""[ \t]+(?!(?:null|true|false|[\d.]+)\s*(?:#|$))["']?[^\W_]""", re.MULTILINE)
"""A text that begins as a name does, and no list, mapping, alias or tag."""


def looks_like_a_task(path: Path, *, named: bool = False) -> bool:
    """Whether a file begins like a task: by its name and its first bytes, so that any file may be asked about.

    Args:
        path: the file.
        named: somebody said that it is one: then the key `task` is enough, and what is wrong with it is told.
    """
    if path.suffix not in SUFFIXES or path.name.startswith("."):
        return False
    try:
        if not path.is_file():  # opening a pipe would wait for who writes into it
            return False
        with path.open("rb") as file:
            text = file.read(SNIFFED).removeprefix(b"\xef\xbb\xbf")
    except OSError:
        return False
    task = _TASK.search(text)
    if task is None or named:
        return task is not None
    return _NAME.match(text, task.end()) is not None and _ROBOT.search(text) is not None


def is_entered(folder: Path) -> bool:
    """Whether tasks are looked for in a folder that nobody named."""
    return not (folder.name.startswith(".") or folder.name in NOT_ENTERED or (folder / "pyvenv.cfg").exists())
