"""Workflow commands of GitHub Actions, which show a failure beside the line that it is about."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from manipcli.report.suite import CaseReport
from manipcli.report.suite_text import once_a_file


def render_annotations(reports: Sequence[CaseReport], *, workspace: Path | None = None) -> str:
    """`::error file=...,line=...,col=...,title=...::message`, a line each trouble.

    Args:
        reports: those that passed give nothing.
        workspace: the checkout that GitHub shows, to which the names of files are made relative.
    """
    return "\n".join(
        _command(
            report,
            file=trouble.place.file if trouble.place is not None else report.case.file,
            at=(trouble.place.line, trouble.place.column) if trouble.place is not None else (1, 1),
            message=trouble.message,
            workspace=workspace,
        )
        for report in once_a_file(reports)
        if not report.passed
        for trouble in report.troubles
    )


def _command(report: CaseReport, *, file: str, at: tuple[int, int], message: str, workspace: Path | None) -> str:
    if workspace is not None:
        # A file outside of the checkout keeps a name that nothing there has.
        file = os.path.relpath(file, workspace)
    line, column = at
    words = {
        "file": file,
        "line": str(max(line, 1)),
        "col": str(max(column, 1)),
        "title": f"{report.case.name} {report.outcome}",
    }
    properties = ",".join(f"{key}={_property(value)}" for key, value in words.items())
    return f"::error {properties}::{_data(message)}"


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
