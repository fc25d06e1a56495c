"""Cache of computed results in the user's cache folder: a damaged, foreign or unwritable file is a missing one.

Every file is `MAGIC`, the SHA-256 of its content, and the content. A result is found by a key that contains everything
it depends on, so entries never become stale; deleting the folder only costs time.
"""

from __future__ import annotations

import hashlib
import os
import stat
from pathlib import Path
from typing import Final

from manipcli.core.whole_file import write_whole

MAGIC: Final = b"manipcli cache 1\n"
MOST_BYTES: Final = 64_000_000


def cache_key(*parts: bytes | str) -> str:
    """A key of everything that a result depends on; the lengths keep ("ab", "c") and ("a", "bc") apart."""
    found = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        found.update(len(data).to_bytes(8, "little"))
        found.update(data)
    return found.hexdigest()


def read_cached(kind: str, key: str) -> bytes | None:
    """The stored content; None if there is none, or it is damaged, not a regular file, or too large."""
    path = _file(kind, key)
    if path is None:
        return None
    try:
        # Without O_NONBLOCK a pipe in the folder would block.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        with os.fdopen(descriptor, "rb") as file:
            info = os.fstat(descriptor)
            if not stat.S_ISREG(info.st_mode) or info.st_size > MOST_BYTES:
                return None
            data = file.read(MOST_BYTES)
    except OSError:
        return None
    head, digest, content = data[: len(MAGIC)], data[len(MAGIC) : len(MAGIC) + 64], data[len(MAGIC) + 64 :]
    intact = head == MAGIC and digest == hashlib.sha256(content).hexdigest().encode()
    return content if intact else None


def write_cached(kind: str, key: str, content: bytes) -> None:
    """Stores a result; does nothing where the folder cannot be written."""
    path = _file(kind, key)
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_dir():
            write_whole(path, MAGIC + hashlib.sha256(content).hexdigest().encode() + content)
    except OSError:
        return


def _file(kind: str, key: str) -> Path | None:
    """The file of an entry; None without a cache folder."""
    folder = cache_folder()
    return None if folder is None else folder / kind / key


def cache_folder() -> Path | None:
    """The folder of all entries; None without a home folder.

    Source: XDG Base Directory Specification: a relative XDG_CACHE_HOME is ignored.
    """
    named = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if named.is_absolute():
        return named / "manipcli"
    try:
        return Path.home() / ".cache" / "manipcli"
    except RuntimeError:  # no home folder
        return None
