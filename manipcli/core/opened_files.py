"""The files that a call opens, and whether they have changed since."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
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
        return all(stamp(path) == before for path, before in self.stamps)


_recording: list[dict[Path, Stamp]] = []
"""The stamps of the calls that are being recorded."""


@cache
def _install() -> None:
    """Adds the audit hook, once: Python keeps it until the process ends."""

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        if event == "open" and _recording and isinstance(arguments[0], str | bytes):
            path = Path(os.fsdecode(arguments[0])).absolute()
            bytecode = sys.pycache_prefix is not None and path.is_relative_to(sys.pycache_prefix)
            if bytecode or path.parent.name == "__pycache__":  # written by the first import of a module
                return
            for stamps in _recording:
                stamps.setdefault(path, stamp(path))

    sys.addaudithook(hook)


def opened_by(call: Callable[[], T]) -> tuple[T, OpenedFiles]:
    """Calls, and records every file that Python opens meanwhile, for reading or writing, but for its compiled modules.

    A file is stamped before it is read: if it changes meanwhile, the stamp is that of the older content.
    """
    stamps: dict[Path, Stamp] = {}
    _install()
    _recording.append(stamps)
    try:
        result = call()
    finally:
        _recording[:] = [other for other in _recording if other is not stamps]
    return result, OpenedFiles(tuple(stamps.items()))


def stamp(path: Path) -> Stamp:
    """The stamp of a file now."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
