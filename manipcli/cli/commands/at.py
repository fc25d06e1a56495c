"""`manipcli at LOG T`: a snapshot of a log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import Format, LogFile, seconds
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.text import did_you_mean, shorten


def at(
    log: LogFile,
    time: Annotated[
        str,
        typer.Argument(
            metavar="T",
            help="Time from the start of the log: 3.2, '3.2 s', 250ms; or a step, for its end.",
            show_default=False,
        ),
    ],
    *,
    format_: Format = "text",
) -> ExitCode:
    """Show a snapshot of a log: step, joints, poses, contacts.

    Works with any ROS 2 log, as far as its topics allow.
    """
    from manipcli.logs.snapshot import moment
    from manipcli.report.logs.snapshot import render_json, render_text

    found = moment(log, _when(log, time))
    console.result(render_json(found) if format_ == "json" else render_text(found))
    return ExitCode.PASSED


def _when(log: Path, word: str) -> float:
    """[s] A time, or the end of a step.

    Raises:
        InvalidInput: `word` is neither a time nor a step.
    """
    try:
        return seconds(word)
    except InvalidInput:
        from manipcli.logs.snapshot import step_ends

        ends = step_ends(log)
        if word in ends:
            return ends[word]
        hint = did_you_mean(word, ends, kind="steps")
        if hint is None:
            raise
        message = f"'{shorten(word)}' is neither a time nor a step of this log"
        raise InvalidInput([Diagnostic("USE050", message, hint=hint)]) from None
