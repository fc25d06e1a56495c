"""Atomic writing of files: a file is complete or absent."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def write_whole(path: Path, data: bytes) -> None:
    """Writes a file atomically; see `whole_file`."""
    with whole_file(path) as partial:
        partial.write_bytes(data)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yields a temporary path in the same folder, and renames it to `path` if the block succeeds.

    If the block raises, an existing file stays unchanged. Links are followed; devices and pipes (`/dev/stdout`) are
    written directly.

    Raises:
        OSError: the file cannot be written; names `path`.
    """
    if path.exists() and not path.is_file():
        try:
            yield path
        except OSError as error:
            error.filename = error.filename or str(path)
            raise
        return
    whole = Path(os.path.realpath(path))
    partial = whole.with_name(f".{whole.name}.{os.getpid()}.partial")
    try:
        partial.touch()  # an unwritable path fails before the work
        yield partial
        partial.replace(whole)
    except OSError as error:
        # Errors while writing name no file, or the partial one, which the user does not know.
        if error.filename is None or os.fspath(error.filename) == str(partial):
            error.filename = str(path)
        raise
    finally:
        partial.unlink(missing_ok=True)
