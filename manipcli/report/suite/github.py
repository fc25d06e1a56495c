"""Failures as workflow commands of GitHub Actions, which annotate the lines of the files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from manipcli.core.errors import Place
from manipcli.report.suite.suite import CaseReport, Trouble
from manipcli.report.suite.suite_text import once_a_file


def render_annotations(reports: Sequence[CaseReport], *, workspace: Path | None = None) -> str:
    """`::error file=...,line=...,col=...,title=...::message`, one line per trouble.

    Args:
        reports: the runs; a passed one has no annotation.
        workspace: root of the checkout; file names are made relative to it.
    """
    return "\n".join(
        _command(report, trouble, workspace)
        for report in once_a_file(reports)
        if not report.passed
        for trouble in report.troubles
    )


def _command(report: CaseReport, trouble: Trouble, workspace: Path | None) -> str:
    """Annotation at the line of the trouble; without a line, at the line of the task."""
    place, message = trouble.place, trouble.message
    if place is None or place.line == 0:
        message = message if place is None else f"{place}: {message}"
        place = Place(report.case.file, 1, 1)
    # A file outside the checkout keeps its absolute name.
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
