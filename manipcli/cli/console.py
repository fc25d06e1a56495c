"""The only file that prints. stdout is the result, stderr is talk.

Text is made safe before it reaches a terminal (control characters escaped, what the encoding lacks written as `\\x..`),
and coloured only on a terminal that wants it; colour never says what the words do not. A reader that goes away
(`manipcli list | head`) ends nothing: the exit code stays that of the command. Only a file that goes to stdout must get
there whole.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from manipcli.core.text import escape

MOST_NOT_DRAWN = 5
"""Lines that are told of what a picture lacks."""
STDOUT = "standard output"
"""What stdout is called where it cannot be written."""
_COLOURS = {"✓": "32", "✗": "31", "error[": "31", "warning[": "33", "note[": "36", "hint:": "36"}
_PAINTED = re.compile("|".join(re.escape(word) for word in _COLOURS))


def prepare() -> None:
    """Once at the start: no character may fail to print, and no file may take the place of a closed stream.

    Started with `>&-`, the next file that is opened would get descriptor 1, and what others print would go there.
    """
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest that is free: this one
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")


def result(text: str) -> None:
    """What the command was asked for, to stdout."""
    _write(sys.stdout, f"{_dressed(text, sys.stdout)}\n")


def result_is_terminal() -> bool:
    """Whether somebody looks at what the command was asked for, and no file or program takes it."""
    return _is_terminal(sys.stdout)


def result_bytes(path: Path) -> None:
    """A file that the command was asked for, to stdout as it is.

    Raises:
        OSError: it did not get there whole, also where the reader went away.
    """
    stream = sys.stdout
    if stream is None or stream.closed:
        return
    with path.open("rb") as file, _through(stream, whole=True):
        shutil.copyfileobj(file, stream.buffer)


def talk(text: str) -> None:
    """Everything else, to stderr."""
    _write(sys.stderr, f"{_dressed(text, sys.stderr)}\n")


def not_drawn(lines: Sequence[str]) -> None:
    """What a picture lacks: some of it, and how much more."""
    shown = lines if len(lines) <= MOST_NOT_DRAWN else lines[: MOST_NOT_DRAWN - 1]
    for line in shown:
        talk(f"not drawn: {line}")
    if len(shown) < len(lines):
        talk(f"not drawn: {len(lines) - len(shown)} more")


def is_live() -> bool:
    """Whether stderr is a terminal whose line can be drawn again."""
    return _is_terminal(sys.stderr) and os.environ.get("TERM") != "dumb"


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
    return _is_terminal(stream) and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


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
def _through(stream: TextIO, *, whole: bool = False) -> Iterator[None]:
    """What is written in the block goes through to the end: a full disk or a closed pipe is met here, not at exit.

    `whole`: a reader that went away before is an error.
    """
    try:
        yield
        stream.flush()
    except OSError as error:
        error.filename = STDOUT if stream is sys.stdout else "standard error"
        _abandon(stream)
        if whole or not isinstance(error, BrokenPipeError):
            raise


def _abandon(stream: TextIO) -> None:
    """Sends what is still buffered nowhere, or the interpreter would try again at exit and change the exit code."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
