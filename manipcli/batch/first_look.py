"""Whether a file is worth reading as a task. Asked of any file of anybody: nothing else of ours is imported here."""

from __future__ import annotations

import codecs
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

SUFFIXES = (".yaml", ".yml")
SNIFFED = 65536
"""Bytes of a file in which keys are looked for: nothing else of foreign files is read."""
NOT_ENTERED = frozenset({"runs", "build", "dist", "node_modules", "site-packages", "__pycache__"})
"""Folders that hold results and what others wrote; as well as hidden ones and virtual environments."""
_KEY = rb"""\n(?:(?<=\A\n)\s*\{(?s:.*[,{])?\s*)?(["']?)(?:%b)\1[ \t]*:(?=\s)"""
"""A top-level key, of a text that begins with a line feed: looking for one costs a tenth of looking for `^`."""
_TASK, _ROBOT, _CONTROLLERS, _STEPS, _OURS = (
    re.compile(_KEY % key)
    for key in (b"task", b"robot", b"controllers", b"steps", b"controllers|scene|steps|expect|start|simulation")
)
_NAME = re.compile(rb"""[ \t]+(?!(?:null|true|false|[\d.]+)\s*(?:#|$))["']?[^\W_]""", re.MULTILINE)
"""A text that begins as a name does, and no list, mapping, alias or tag."""
_NO_SCALAR = re.compile(
    rb"""[ \t]+[\[{*&!]|[ \t]*(?:#[^\n]*)?\r?\n(?:\s*#[^\n]*\n)*\s*(?:-[ \t]|[ \t][^\s#][^\n]*:\s)"""
)

Look = Literal["task", "no robot", "no task", "other"]
"""`no robot`, `no task`: looks like a task that lacks this key, or has it misspelt."""
LEFT_OUT: Mapping[Look, str] = {
    "no robot": "has `task:` but no `robot:`; not run",
    "no task": "has `robot:`, `controllers:` and `steps:` but no `task:`; not run",
}
"""What is told of a file that looks like a task and is none."""


def first_look(path: Path, *, named: bool = False) -> Look:
    """What a file is by its name and its first bytes, so that any file may be asked about.

    Args:
        path: the file.
        named: somebody said that it is a task: then the key `task` is enough, and what is wrong with it is told.
    """
    if path.suffix.lower() not in SUFFIXES or path.name.startswith("."):
        return "other"
    try:
        if not path.is_file():  # opening a pipe would wait for who writes into it
            return "other"
        with path.open("rb") as file:
            text = _utf_8(file.read(SNIFFED))
    except OSError:
        return "other"
    if b"task" not in text and b"robot" not in text:  # as foreign files are, and this is quickly said
        return "other"
    text = _flush(text)
    task = _TASK.search(text)
    if task is None:
        torn = not named and all(key.search(text) is not None for key in (_ROBOT, _CONTROLLERS, _STEPS))
        return "no task" if torn else "other"
    if named:
        return "task"
    robot = _ROBOT.search(text) is not None
    if robot and _NAME.match(text, task.end()):
        return "task"
    # Others have a `task:` as well: who else has such keys, and no mapping or list there, has written one of ours.
    if _OURS.search(text) is None or _NO_SCALAR.match(text, task.end()):
        return "other"
    return "task" if robot else "no robot"


def is_entered(folder: Path) -> bool:
    """Whether tasks are looked for in a folder that nobody named; links may lead around in circles."""
    if folder.name.startswith(".") or folder.name in NOT_ENTERED:
        return False
    return not (folder.is_symlink() or (folder / "pyvenv.cfg").exists())


def _utf_8(text: bytes) -> bytes:
    """Without the mark at its beginning; of UTF-16, in which no task can be written, so that this is told."""
    if text.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return text.decode("utf-16", "replace").encode("utf-8", "replace")
    return text.removeprefix(codecs.BOM_UTF8)


def _flush(text: bytes) -> bytes:
    """With line feeds alone, one of them before each line, and its top-level keys at the left."""
    text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    lines = text.split(b"\n")
    content = (line for line in lines if line.lstrip(b" ") and not line.lstrip(b" ").startswith((b"#", b"---", b"%")))
    first = next(content, b"")
    by = first[: len(first) - len(first.lstrip(b" "))]
    return b"\n" + (b"\n".join(line.removeprefix(by) for line in lines) if by else text)
