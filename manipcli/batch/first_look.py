"""A quick test whether a file looks like a task, without imports of other modules: pytest runs it for any YAML file."""

from __future__ import annotations

import codecs
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

SUFFIXES = (".yaml", ".yml")
SNIFFED = 65536
"""Bytes of a file in which keys are searched; no more of foreign files is read."""
NOT_ENTERED = frozenset({"runs", "build", "dist", "node_modules", "site-packages", "__pycache__"})
"""Folders of results and of foreign files; hidden folders and virtual environments are not entered either."""
_KEY = rb"""\n(?:(?<=\A\n)\s*\{(?s:.*[,{])?\s*)?(["']?)(?:%b)\1[ \t]*:(?=\s)"""
"""A top-level key in a text that begins with a line feed: searching for it takes a tenth of the time of `^`."""
_TASK, _ROBOT, _CONTROLLERS, _STEPS, _OURS = (
    re.compile(_KEY % key)
    for key in (b"task", b"robot", b"controllers", b"steps", b"controllers|scene|steps|expect|start|simulation")
)
_NAME = re.compile(rb"""[ \t]+(?!(?:null|true|false|[\d.]+)\s*(?:#|$))["']?[^\W_]""", re.MULTILINE)
"""Text that begins like a name, and not like a list, mapping, alias or tag."""
_NO_SCALAR = re.compile(
    rb"""[ \t]+[\[{*&!]|[ \t]*(?:#[^\n]*)?\r?\n(?:\s*#[^\n]*\n)*\s*(?:-[ \t]|[ \t][^\s#][^\n]*:\s)"""
)

Look = Literal["task", "no robot", "no task", "other"]
"""`no robot`, `no task`: looks like a task in which this key is missing or misspelled."""
LEFT_OUT: Mapping[Look, str] = {
    "no robot": "has `task:` but no `robot:`; not run",
    "no task": "has `robot:`, `controllers:` and `steps:` but no `task:`; not run",
}
"""Message about a file that looks like a task but is not."""


def first_look(path: Path, *, named: bool = False) -> Look:
    """The kind of a file by its name and its first bytes; safe for any file.

    Args:
        path: the file.
        named: the user named it as a task: then the key `task` is enough, and its errors are reported later.
    """
    if path.suffix.lower() not in SUFFIXES or path.name.startswith("."):
        return "other"
    try:
        if not path.is_file():  # opening a pipe would wait for a writer
            return "other"
        with path.open("rb") as file:
            text = _utf_8(file.read(SNIFFED))
    except OSError:
        return "other"
    if b"task" not in text and b"robot" not in text:  # most foreign files, found quickly
        return "other"
    text = _flush(text)
    task = _TASK.search(text)
    if task is None:
        incomplete = not named and all(key.search(text) is not None for key in (_ROBOT, _CONTROLLERS, _STEPS))
        return "no task" if incomplete else "other"
    if named:
        return "task"
    robot = _ROBOT.search(text) is not None
    if robot and _NAME.match(text, task.end()):
        return "task"
    # Foreign files have a `task:`, too; with another of our keys and a scalar there, the file is meant as a task.
    if _OURS.search(text) is None or _NO_SCALAR.match(text, task.end()):
        return "other"
    return "task" if robot else "no robot"


def is_entered(folder: Path) -> bool:
    """Whether tasks are searched in a folder that was not named; links may form cycles, so they are not followed."""
    if folder.name.startswith(".") or folder.name in NOT_ENTERED:
        return False
    return not (folder.is_symlink() or (folder / "pyvenv.cfg").exists())


def _utf_8(text: bytes) -> bytes:
    """The text without byte order mark, from UTF-16 as well: a task may not be UTF-16, and the loader reports it."""
    if text.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return text.decode("utf-16", "replace").encode("utf-8", "replace")
    return text.removeprefix(codecs.BOM_UTF8)


def _flush(text: bytes) -> bytes:
    """The text with one line feed before each line, without carriage returns, and top-level keys in column 1."""
    text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    lines = text.split(b"\n")
    content = (line for line in lines if line.lstrip(b" ") and not line.lstrip(b" ").startswith((b"#", b"---", b"%")))
    first = next(content, b"")
    by = first[: len(first) - len(first.lstrip(b" "))]
    return b"\n" + (b"\n".join(line.removeprefix(by) for line in lines) if by else text)
