"""`run --log -`: the log to stdout, when it is whole; the text that would be there goes to stderr."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from manipcli.cli import console
from manipcli.cli.options import OutputFormat
from manipcli.core.errors import Diagnostic, InvalidInput, ManipcliError


class LogCut(ManipcliError):
    """Whoever read the log went away before its end."""

    code = "LOG201"

    def __init__(self) -> None:
        super().__init__("standard output: the log is lost, its reader went away before the end")


def refuse_stdout(format_: OutputFormat) -> None:
    """
    Raises:
        InvalidInput: somebody else wants stdout, or it is a terminal.
    """
    if format_ == "json":
        message = "--log - and --format json both want stdout"
        raise InvalidInput([Diagnostic("USE051", message, hint="give the log a file, or leave out --format json")])
    if console.result_is_terminal():
        message = "the log would go to the terminal, which cannot show it"
        raise InvalidInput([Diagnostic("USE048", message, hint="redirect it: --log - > run.mcap")])


@contextmanager
def stdout_or(log: Path | None) -> Iterator[Path | None]:
    """Where a run may write its log: `log` itself, or for `-` a file that goes to stdout at the end, however that is.

    The log is judged from its file before it is finished, so a pipe cannot take its place.

    Raises:
        LogCut: it did not get there whole. Typer would take the error of the pipe for an end without a word.
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
            # Finished or not: of a run that broke off, what there is.
            for written in (path, path.with_name(f"{path.name}.partial")):
                if written.exists():
                    try:
                        console.result_bytes(written)
                    except BrokenPipeError:
                        raise LogCut from None
                    break
