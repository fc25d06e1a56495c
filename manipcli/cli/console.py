"""Printing: results to stdout, everything else to stderr. No other file prints.

Text is made safe for a terminal (control characters escaped, characters outside the encoding written as `\\x..`) and
coloured only on a terminal without NO_COLOR, or with FORCE_COLOR; colour adds no information. A reader that closes the
pipe (`manipcli list | head`) does not change the exit code. Only a file that is written to stdout must be complete.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import BinaryIO, TextIO

from manipcli.core.text import escape

MOST_NOT_DRAWN = 5
"""Lines printed at most about parts that a picture lacks."""
STDOUT = "standard output"
"""Name of stdout in errors."""
_COLOURS = {"✓": "32", "✗": "31", "error[": "31", "warning[": "33", "note[": "36", "hint:": "36"}
_PAINTED = re.compile("|".join(re.escape(word) for word in _COLOURS))


_quiet = _verbose = _closed = False


def set_volume(*, quiet: bool, verbose: bool) -> None:
    """How much this command says: `talk` is silent if `quiet`, `detail` speaks only if `verbose`."""
    global _quiet, _verbose
    _quiet, _verbose = quiet, verbose


def prepare() -> None:
    """Prepares the streams, once: every character can be printed, and no file replaces a closed stream.

    A command line begins with the usual volume. Started with `>&-`, the next opened file would get descriptor 1 and
    receive what libraries print.
    """
    global _closed
    _closed = False
    set_volume(quiet=False, verbose=False)
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free descriptor, which is this one
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")


def result(text: str) -> None:
    """Prints a result to stdout."""
    _write(sys.stdout, f"{_dressed(text, sys.stdout)}\n")


def reader_is_gone() -> bool:
    """Whether the reader of stdout has closed the pipe: a command without an end then ends."""
    return _closed


def result_is_terminal() -> bool:
    """Whether stdout is a terminal, and not a file or a pipe."""
    return _is_terminal(sys.stdout)


def stdout_for_bytes() -> BinaryIO:
    """Another handle of stdout, without a buffer: it stays stdout while output of a library is redirected."""
    return os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=0)


def error(text: str) -> None:
    """Prints an error to stderr."""
    _write(sys.stderr, f"{_dressed(text, sys.stderr)}\n")


def talk(text: str) -> None:
    """Prints progress and notes to stderr, unless --quiet is given."""
    if not _quiet:
        error(text)


def detail(text: str) -> None:
    """Prints to stderr what only --verbose asks for."""
    if _verbose:
        error(text)


def not_drawn(lines: Sequence[str]) -> None:
    """Prints the first parts that a picture lacks, and the number of the others."""
    shown = lines if len(lines) <= MOST_NOT_DRAWN else lines[: MOST_NOT_DRAWN - 1]
    for line in shown:
        talk(f"not drawn: {line}")
    if len(shown) < len(lines):
        talk(f"not drawn: {len(lines) - len(shown)} more")


def is_live() -> bool:
    """Whether stderr is a terminal whose line can be redrawn, and --quiet is not given."""
    return not _quiet and _is_terminal(sys.stderr) and os.environ.get("TERM") != "dumb"


def redraw(text: str) -> None:
    """Replaces the current line of a live terminal; `""` clears it."""
    _write(sys.stderr, f"\r\x1b[K{escape(text)[: _columns(sys.stderr) - 1]}")


def _columns(stream: TextIO) -> int:
    try:
        return os.get_terminal_size(stream.fileno()).columns or 80
    except (OSError, ValueError):
        return 80


def _is_terminal(stream: TextIO | None) -> bool:
    return stream is not None and not stream.closed and stream.isatty()


def _is_coloured(stream: TextIO | None) -> bool:
    """NO_COLOR counts before FORCE_COLOR, and any other value than "" and 0 of that before the stream."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR", "0") not in ("", "0"):
        return stream is not None and not stream.closed
    return _is_terminal(stream) and os.environ.get("TERM") != "dumb"


def _dressed(text: str, stream: TextIO | None) -> str:
    text = "\n".join(map(escape, text.split("\n")))
    if not _is_coloured(stream):
        return text
    return _PAINTED.sub(lambda match: f"\x1b[{_COLOURS[match.group()]}m{match.group()}\x1b[0m", text)


def _write(stream: TextIO | None, text: str) -> None:
    if stream is None or stream.closed:
        return
    with _through(stream):
        stream.write(text)


@contextmanager
def _through(stream: TextIO) -> Iterator[None]:
    """Flushes what the block writes, so that a full disk or a closed pipe is found here and not at exit."""
    try:
        yield
        stream.flush()
    except OSError as error:
        error.filename = STDOUT if stream is sys.stdout else "standard error"
        _abandon(stream)
        if not isinstance(error, BrokenPipeError):
            raise


def _abandon(stream: TextIO) -> None:
    """Discards what is still buffered: the interpreter would flush it at exit and change the exit code."""
    global _closed
    _closed = _closed or stream is sys.stdout
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, stream.fileno())
    os.close(null)
