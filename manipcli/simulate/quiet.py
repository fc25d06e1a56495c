"""Keeps what C libraries print off stdout, where only results belong.

Works on file descriptors, because C code knows nothing of `sys.stdout`; one that is closed stays closed.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

STDOUT, STDERR = 1, 2


@contextmanager
def stdout_to_stderr() -> Iterator[None]:
    """What is written to stdout in this block goes to stderr; nowhere, if that is closed."""
    if not _is_open(STDERR):
        with silence():
            yield
        return
    with _sent(STDOUT, STDERR):
        yield


@contextmanager
def silence() -> Iterator[None]:
    """What is written to stdout or stderr in this block is dropped: the banner of a library that is loaded, say."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        with _sent(STDOUT, nowhere), _sent(STDERR, nowhere):
            yield
    finally:
        os.close(nowhere)


@contextmanager
def _sent(descriptor: int, target: int) -> Iterator[None]:
    """C code that buffers its output is flushed on both sides, as Python's own is."""
    _flush()
    saved = os.dup(descriptor) if _is_open(descriptor) else None
    try:
        os.dup2(target, descriptor)
        yield
    finally:
        _flush()
        if saved is None:
            os.close(descriptor)
        else:
            os.dup2(saved, descriptor)
            os.close(saved)


def _is_open(descriptor: int) -> bool:
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        # None or closed when the process was started without it; a reader that went away is met when a result is told.
        if stream is not None and not stream.closed:
            with suppress(OSError):
                stream.flush()
    ctypes.CDLL(None).fflush(None)
