"""Workflow commands of GitHub Actions, which show a failure beside the line that it is about."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from manipcli.core.errors import Place
from manipcli.report.suite.suite import CaseReport, Trouble
from manipcli.report.suite.suite_text import once_a_file


def render_annotations(reports: Sequence[CaseReport], *, workspace: Path | None = None) -> str:
    """`::error file=...,line=...,col=...,title=...::message`, a line each trouble.

    Args:
        reports: those that passed give nothing.
        workspace: the checkout that GitHub shows, to which the names of files are made relative.
    """
    return "\n".join(
        _command(report, trouble, workspace)
        for report in once_a_file(reports)
        if not report.passed
        for trouble in report.troubles
    )


def _command(report: CaseReport, trouble: Trouble, workspace: Path | None) -> str:
    """At the line of the trouble; what has none, as a word of the command line, is told with the task."""
    place, message = trouble.place, trouble.message
    if place is None or place.line == 0:
        message = message if place is None else f"{place}: {message}"
        place = Place(report.case.file, 1, 1)
    # A file outside of the checkout keeps a name that nothing there has.
    file = place.file if workspace is None else os.path.relpath(place.file, workspace)
    words = {
        "file": file,
        "line": str(place.line),
        "col": str(max(place.column, 1)),
        "title": f"{report.case.name} {report.outcome}",
    }
    properties = ",".join(f"{key}={_property(value)}" for key, value in words.items())
    return f"::error {properties}::{_data(message)}"


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
