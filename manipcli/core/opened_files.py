"""The files that a call opens, and whether they have changed since."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias, TypeVar

T = TypeVar("T")

Stamp: TypeAlias = "tuple[int, int, int, int] | None"


@dataclass(frozen=True, slots=True)
class OpenedFiles:
    """Paths of files, and their stamps when they were first opened.

    A stamp is device, inode, size and time of the last change [ns]; None for a file that did not exist.
    """

    stamps: tuple[tuple[Path, Stamp], ...]

    def unchanged(self) -> bool:
        """Whether all stamps are the same now."""
        return all(_stamp(path) == stamp for path, stamp in self.stamps)


def opened_by(call: Callable[[], T]) -> tuple[T, OpenedFiles]:
    """Calls, and records every file that Python opens meanwhile, for reading or writing.

    Python keeps an audit hook until the process ends, so this is for a process that calls it once. A file is stamped
    before it is read: if it changes meanwhile, the stamp is that of the older content.
    """
    stamps: dict[Path, Stamp] = {}
    recording = True

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        if event == "open" and recording and isinstance(arguments[0], str | bytes):
            path = Path(os.fsdecode(arguments[0])).absolute()
            stamps.setdefault(path, _stamp(path))

    sys.addaudithook(hook)
    try:
        result = call()
    finally:
        recording = False
    return result, OpenedFiles(tuple(stamps.items()))


def _stamp(path: Path) -> Stamp:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
