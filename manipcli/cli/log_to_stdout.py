"""The log on stdout (`run --log -`), written when it is complete; the text report goes to stderr."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from manipcli.cli import console
from manipcli.cli.options import OutputFormat
from manipcli.core.errors import Diagnostic, InvalidInput, ManipcliError


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


@contextmanager
def stdout_or(log: Path | None) -> Iterator[Path | None]:
    """The file for the log of a run: `log` itself, or for `-` a temporary file that is copied to stdout at the end.

    The log is judged from its file before it is finished, so a pipe cannot replace the file.

    Raises:
        LogTruncated: not all of it could be copied. Typer would end without a message on the error of the pipe.
        OSError: the disk is full.
    """
    if log is None or str(log) != "-":
        yield log
        return
    from tempfile import TemporaryDirectory

    with TemporaryDirectory(prefix="manipcli-") as folder:
        path = Path(folder) / "stdout"
        try:
            yield path
        finally:
            # Also the partial log of a run that did not finish.
            for written in (path, path.with_name(f"{path.name}.partial")):
                if written.exists():
                    try:
                        console.result_bytes(written)
                    except BrokenPipeError:
                        raise LogTruncated from None
                    break
