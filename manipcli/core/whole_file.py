"""Files that are there whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def write_whole(path: Path, data: bytes) -> None:
    """Writes a file; see `whole_file`."""
    with whole_file(path) as partial:
        partial.write_bytes(data)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A name beside that of a file, to write to; the file gets its own name when the block ends well.

    What was there before is replaced then, and stays as it is where the block does not end well. A link is followed; a
    device or a pipe (`/dev/stdout`) is itself what is written to.

    Raises:
        OSError: nothing can be written there.
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
        partial.touch()  # what cannot be written is told before the work
        yield partial
        partial.replace(whole)
    except OSError as error:
        # What fails while it is written names no file; and the user does not know of the partial one.
        if error.filename is None or os.fspath(error.filename) == str(partial):
            error.filename = str(path)
        raise
    finally:
        partial.unlink(missing_ok=True)
