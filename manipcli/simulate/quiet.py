"""Keeps what C libraries print off stdout, where only results belong."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def stdout_to_stderr() -> Iterator[None]:
    """What is written to file descriptor 1 in this block goes to stderr."""
    with _stdout_as(2):
        yield


@contextmanager
def stdout_nowhere() -> Iterator[None]:
    """What is written to file descriptor 1 in this block is dropped: a banner, say."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        with _stdout_as(nowhere):
            yield
    finally:
        os.close(nowhere)


@contextmanager
def _stdout_as(descriptor: int) -> Iterator[None]:
    """C code that buffers its stdout is flushed on both sides, as Python's own is."""
    _flush()
    saved = os.dup(1)
    try:
        os.dup2(descriptor, 1)
        yield
    finally:
        _flush()
        os.dup2(saved, 1)
        os.close(saved)


def _flush() -> None:
    sys.stdout.flush()
    ctypes.CDLL(None).fflush(None)
