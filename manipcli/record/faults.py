"""What can go wrong with a recording: it cannot be begun, cannot be written further, or cannot be read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput, ManipcliError, Place
from manipcli.core.text import any_of, listed, nearest_file


class RecordingRefused(InvalidInput):
    """No recording can be begun at this path; nothing has been written."""

    code = "LOG100"

    def __init__(self, path: Path, cause: str, *, hint: str | None = None) -> None:
        super().__init__((Diagnostic(code=self.code, message=f"cannot record to {path}: {cause}", hint=hint),))


class RecordingFailed(ManipcliError):
    """The disk refused more, for `cause`. What was written until `time` [s] stays readable in the partial file.

    `known`: of the run, by the keys of a report, where a run is what was recorded.
    """

    exit_code: ClassVar[ExitCode] = ExitCode.INTERNAL
    code: ClassVar[str] = "LOG200"

    def __init__(self, partial: Path, cause: str, *, time: float) -> None:
        self.partial = partial
        self.cause = cause
        self.time = time
        self.known: Mapping[str, str | int] = {}
        super().__init__(
            f"the recording stopped after t = {time:.3f} s: {cause}; what was recorded until then is in {partial.name}"
        )


class CopyFailed(ManipcliError):
    """The disk refused a clean copy of a log. Nothing is left of the copy, and the log is as it was."""

    exit_code: ClassVar[ExitCode] = ExitCode.INTERNAL
    code: ClassVar[str] = "LOG202"

    def __init__(self, output: Path, cause: str, *, source: Path) -> None:
        super().__init__(f"cannot write {output}: {cause}; nothing of the copy is left, and {source} is as it was")


PARTIAL = ".partial"
"""What the name of a log ends in until it is finished."""

REPAIRABLE = "manipcli repair keeps what is sound of it"
"""The hint where a file is damaged."""


class BadRecording(InvalidInput):
    """A file that is no recording of manipcli, or one that was changed or damaged after it was written."""

    code = "LOG300"

    def __init__(self, path: Path, cause: str, *, hint: str | None = None) -> None:
        self.cause = cause
        left = path.parent / f"{path.name}{PARTIAL}"  # of a folder that has no name, too
        if hint is None and not path.exists():
            hint = _beside(path)
            if left.is_file():
                hint = f"{left.name} is there: a run that did not come to its end left it; give its name"
        super().__init__((Diagnostic(code=self.code, message=cause, place=Place(str(path), 0, 0), hint=hint),))


def _beside(path: Path) -> str | None:
    """The log that was meant, or those that are in its folder."""
    if not path.parent.is_dir():
        return f"the folder '{path.parent}' is not there either"
    names = sorted(each.name for each in path.parent.glob("*.mcap"))
    close = nearest_file(path.name, names)
    return f"did you mean {any_of(close)}?" if close else f"logs beside it: {listed(names)}" if names else None


LEFT_OUT = "another program left out messages of joints, bodies, controllers or contacts"


class Thinned(BadRecording):
    """A recording of which another program left messages out: it can be read like a log of any program, no closer."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path,
            LEFT_OUT,
            hint="manipcli replay, at and plot show what there is; all else needs the log as it was recorded",
        )
