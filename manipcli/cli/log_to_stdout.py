"""The log on stdout (`run --log -`), copied there as it is written; the text report goes to stderr."""

from __future__ import annotations

import shutil
import threading
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

from manipcli.cli import console
from manipcli.cli.options import OutputFormat
from manipcli.core.errors import Diagnostic, InvalidInput, ManipcliError
from manipcli.record.faults import PARTIAL

PERIOD: Final = 0.1
"""[s] between two looks at the log."""


class LogTruncated(ManipcliError):
    """The reader of the log closed the pipe before its end."""

    code = "LOG201"

    def __init__(self) -> None:
        super().__init__("standard output: the log is incomplete: its reader closed the pipe before the end")


def refuse_stdout(format_: OutputFormat) -> None:
    """
    Raises:
        InvalidInput: `--format json` writes to stdout, too, or it is a terminal.
    """
    if format_ == "json":
        message = "--log - and --format json both write to stdout"
        raise InvalidInput([Diagnostic("USE051", message, hint="write the log to a file, or omit --format json")])
    if console.result_is_terminal():
        message = "--log - would write the binary log to the terminal"
        raise InvalidInput([Diagnostic("USE048", message, hint="redirect it: --log - > run.mcap")])


class _Feed(threading.Thread):
    """Copies a log to stdout while it is written, until `finish`; ends the run if the reader has gone."""

    def __init__(self, path: Path) -> None:
        super().__init__(daemon=True)
        self._stdout = console.stdout_for_bytes()
        self._names = (path, path.with_name(f"{path.name}{PARTIAL}"))
        self._finished = threading.Event()
        self._error: OSError | None = None

    def run(self) -> None:
        over = False
        while (file := self._opened()) is None:
            if over:  # it was over before this look: there is no log
                return
            over = self._finished.wait(PERIOD)
        try:
            with file, self._stdout:
                waiting = True
                while waiting:
                    waiting = not self._finished.wait(PERIOD)  # then what was written last is still copied
                    shutil.copyfileobj(file, self._stdout)
        except OSError as error:
            error.filename = console.STDOUT
            self._error = error
            if not self._finished.is_set():
                interrupt_main()

    def finish(self) -> None:
        """Copy the rest.

        Raises:
            LogTruncated: not all of it could be copied. Typer would end without a message on the error of the pipe.
            OSError: the disk is full.
        """
        self._finished.set()
        self.join()
        if isinstance(self._error, BrokenPipeError):
            raise LogTruncated from None
        if self._error is not None:
            raise self._error

    def _opened(self) -> BinaryIO | None:
        for path in self._names:
            with suppress(FileNotFoundError):
                return path.open("rb")
        return None


@contextmanager
def stdout_or(log: Path | None) -> Iterator[Path | None]:
    """The file for the log of a run: `log` itself, or for `-` a temporary file that is copied to stdout as it grows.

    The log is judged from its file before it is finished, so a pipe cannot replace the file.

    Raises:
        LogTruncated, OSError: see `_Feed.finish`.
    """
    if log is None or str(log) != "-":
        yield log
        return
    from tempfile import TemporaryDirectory

    with TemporaryDirectory(prefix="manipcli-") as folder:
        path = Path(folder) / "stdout"
        feed = _Feed(path)
        feed.start()
        try:
            yield path
        finally:
            feed.finish()  # also the partial log of a run that did not finish
