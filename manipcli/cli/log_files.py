"""Logs on the command line: MCAP files, and folders of rosbag2."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer


def is_log(path: Path) -> bool:
    """Whether an argument is a log rather than a file of a task."""
    from manipcli.record.foreign.bag import METADATA
    from manipcli.record.records import begins_as_log

    return path.suffix in (".mcap", ".partial") or begins_as_log(path) or (path / METADATA).is_file()


def opened(context: typer.Context, path: Path) -> Path:
    """Callback of an argument: the MCAP file of a log; see `one_file`.

    Raises:
        InvalidInput: the folder is not a bag, or one in a format that is not read.
    """
    return path if context.resilient_parsing else context.with_resource(one_file(path))


@contextmanager
def one_file(path: Path) -> Iterator[Path]:
    """The file of a log: of the folder of a bag its file, or its parts joined in a temporary file.

    Raises:
        InvalidInput: the folder is not a bag, or one in a format that is not read.
    """
    if not path.is_dir():
        yield path
        return
    from tempfile import TemporaryDirectory

    from manipcli.record.foreign.bag import bag_files
    from manipcli.record.foreign.join import join

    files = bag_files(path)
    if len(files) == 1:
        yield files[0]
        return
    with TemporaryDirectory(prefix="manipcli-") as folder:
        whole = Path(folder) / f"{path.resolve().name}.mcap"
        join(files, whole)
        yield whole
