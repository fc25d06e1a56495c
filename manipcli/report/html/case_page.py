"""HTML page of a run that did not finish: cause, place, last picture and process output."""

from __future__ import annotations

import base64
import os
from importlib.resources import files
from pathlib import Path

from manipcli.replay.player import POLICY
from manipcli.report.html.markup import Markup, document, element, link
from manipcli.report.suite.suite import CaseReport
from manipcli.report.suite.suite_text import beforehand

LONGEST = 100_000
"""Longest part of the process output that is shown, from its end [byte]."""


def render_case_page(report: CaseReport, folder: Path, *, index: str = "") -> str:
    """The page for a file in `folder`: picture and output embedded, the log and the `index` page linked."""
    style = Markup(files("manipcli.report.html").joinpath("page", "report.css").read_text("utf-8"))
    head = element(
        "header",
        element(
            "div", element("h1", report.case.name), element("span", f"✗ {report.outcome}", class_="verdict failed"),
            class_="title",
        ),
        element("p", report.case.file, class_="subtitle"),
    )  # fmt: skip
    causes = [
        element(
            "p", element("span", str(trouble.place), class_="place") if trouble.place else None, " ", trouble.message
        )
        for trouble in report.troubles
    ]
    log = element("a", report.log, href=link(report.log, folder)) if report.log is not None else None
    why = element(
        "section",
        *(causes or [element("p", report.text)]),
        *(element("p", line) for line in (*beforehand(report, whole=True), *report.notes)),
        element("p", "Partial log: ", log) if log is not None else None,
        element("p", "Reproduce: ", element("code", report.command)),
        class_="why",
    )
    title = f"✗ {report.case.name} {report.outcome}"
    back = element("nav", element("a", "All runs", href=index)) if index else None
    body = element("main", why, _picture(report), _output(report))
    return document(title, head, back, body, style=style, policy=POLICY)


def _picture(report: CaseReport) -> Markup | None:
    if report.picture is None:
        return None
    data = base64.b64encode(Path(report.picture).read_bytes()).decode()
    shown = element("img", src=f"data:image/png;base64,{data}", alt="last state in the log")
    return element("section", element("h2", "Last state in the log"), element("figure", shown))


def _output(report: CaseReport) -> Markup | None:
    if report.output is None:
        return None
    with Path(report.output).open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - LONGEST))
        text = file.read().decode("utf-8", "replace")
    lines = [element("div", line) for line in text.splitlines()]
    return element("section", element("h2", "Process output"), element("pre", *lines, class_="scroll", tabindex="0"))
