"""Redirection of the output of C libraries away from stdout, which is for results.

It works on file descriptors, because C code does not use `sys.stdout`; a closed descriptor stays closed.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress

STDOUT, STDERR = 1, 2
_redirected: list[int] = []
"""Copies of stdout before it was redirected to stderr, the innermost last."""


@contextmanager
def stdout_to_stderr() -> Iterator[None]:
    """Redirect stdout to stderr in this block; drop the output if stderr is closed."""
    with ExitStack() as until:
        if _is_open(STDOUT):
            _redirected.append(os.dup(STDOUT))
            until.callback(lambda: os.close(_redirected.pop()))
        until.enter_context(_sent(STDOUT, STDERR) if _is_open(STDERR) else silence())
        yield


@contextmanager
def original_stdout() -> Iterator[None]:
    """Print to the stdout before `stdout_to_stderr` in this block, for a result inside of it."""
    if not _redirected:
        yield
        return
    with _sent(STDOUT, _redirected[-1]):
        yield


@contextmanager
def silence() -> Iterator[None]:
    """Drop all output to stdout and stderr in this block, for example the banner of a library."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        with _sent(STDOUT, nowhere), _sent(STDERR, nowhere):
            yield
    finally:
        os.close(nowhere)


@contextmanager
def _sent(descriptor: int, target: int) -> Iterator[None]:
    """Redirect a descriptor; buffers of Python and of C code are flushed before and after."""
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
        # None or closed if the process was started without it; a broken pipe is handled where results are printed.
        if stream is not None and not stream.closed:
            with suppress(OSError):
                stream.flush()
    ctypes.CDLL(None).fflush(None)
