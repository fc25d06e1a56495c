"""Errors of recordings: refused at the start, failed while writing, or not readable."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput, ManipcliError, Place
from manipcli.core.text import any_of, listed, nearest_file


class RecordingRefused(InvalidInput):
    """A recording cannot be started at this path; nothing is written."""

    code = "LOG100"

    def __init__(self, path: Path, cause: str, *, hint: str | None = None) -> None:
        super().__init__((Diagnostic(code=self.code, message=f"cannot record to {path}: {cause}", hint=hint),))


class RecordingFailed(ManipcliError):
    """Writing failed because of `cause`. The data until `time` [s] stays readable in the partial file.

    `known`: values of the run for its report, by JSON key.
    """

    exit_code: ClassVar[ExitCode] = ExitCode.INTERNAL
    code: ClassVar[str] = "LOG200"

    def __init__(self, partial: Path, cause: str, *, time: float) -> None:
        self.partial = partial
        self.cause = cause
        self.time = time
        self.known: Mapping[str, str | int] = {}
        super().__init__(f"recording stopped at t = {time:.3f} s: {cause}; data until then is in {partial.name}")


class CopyFailed(ManipcliError):
    """Writing a repaired copy failed. The incomplete copy is removed and the log is unchanged."""

    exit_code: ClassVar[ExitCode] = ExitCode.INTERNAL
    code: ClassVar[str] = "LOG202"

    def __init__(self, output: Path, cause: str, *, source: Path) -> None:
        super().__init__(f"cannot write {output}: {cause}; the incomplete copy is removed, {source} is unchanged")


PARTIAL = ".partial"
"""Suffix of an unfinished log."""

REPAIRABLE = "recover the undamaged parts with `manipcli repair`"
"""Hint for damaged files."""


class BadRecording(InvalidInput):
    """A file that is not a recording of manipcli, or was changed or damaged."""

    code = "LOG300"

    def __init__(self, path: Path, cause: str, *, hint: str | None = None) -> None:
        self.cause = cause
        left = path.parent / f"{path.name}{PARTIAL}"  # also for a path without a name, such as .
        if hint is None and not path.exists():
            hint = _beside(path)
            if left.is_file():
                hint = f"an unfinished run left {left.name}: use this name"
        super().__init__((Diagnostic(code=self.code, message=cause, place=Place(str(path), 0, 0), hint=hint),))


def _beside(path: Path) -> str | None:
    """The hint for a missing log: similar names, or the logs in its folder."""
    if not path.parent.is_dir():
        return f"folder '{path.parent}' does not exist"
    names = sorted(log.name for log in path.parent.glob("*.mcap"))
    close = nearest_file(path.name, names)
    return f"did you mean {any_of(close)}?" if close else f"logs in this folder: {listed(names)}" if names else None


LEFT_OUT = "filtered by another program: messages of joints, bodies, controllers or contacts are missing"


class Thinned(BadRecording):
    """A recording filtered by another program; it can only be read like a log of another program."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path,
            LEFT_OUT,
            hint="use the original log, or show the rest with manipcli replay, at or plot",
        )
