"""Atomic writing of files: a file is complete or absent."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
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
    whole, partial = _names(path)
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
        with suppress(OSError):  # a name too long cannot be removed either, and must not hide the error
            partial.unlink()


def touched(path: Path) -> None:
    """Creates and removes the temporary file that `whole_file` would write; `path` itself stays as it is.

    Raises:
        OSError: it cannot be created.
    """
    if path.exists() and not path.is_file():
        return
    _, partial = _names(path)
    partial.touch()
    partial.unlink()


def _names(path: Path) -> tuple[Path, Path]:
    """The file with links followed, and its temporary file."""
    whole = Path(os.path.realpath(path))
    return whole, whole.with_name(f".{whole.name}.{os.getpid()}.partial")
