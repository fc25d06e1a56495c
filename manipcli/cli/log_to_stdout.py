"""`run --log -`: the log to stdout, when it is whole; the text that would be there goes to stderr."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from manipcli.cli import console
from manipcli.cli.options import OutputFormat
from manipcli.core.errors import Finding, InvalidInput


def refuse_stdout(format_: OutputFormat) -> None:
    """
    Raises:
        InvalidInput: somebody else wants stdout, or it is a terminal.
    """
    if format_ == "json":
        message = "--log - and --format json both want stdout"
        raise InvalidInput([Finding("USE047", message, hint="give the log a file, or leave out --format json")])
    if console.result_is_terminal():
        message = "the log would go to the terminal, which cannot show it"
        raise InvalidInput([Finding("USE048", message, hint="redirect it: --log - > run.mcap")])


@contextmanager
def stdout_or(log: Path | None) -> Iterator[Path | None]:
    """Where a run may write its log: `log` itself, or for `-` a file that goes to stdout at the end, however that is.

    The log is judged from its file before it is finished, so a pipe cannot take its place.
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
                    console.result_bytes(written)
                    break
