"""The page about a run that did not come to its end: why, where, and what it left."""

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
"""Bytes of the end of what it said that are shown."""


def render_case_page(report: CaseReport, folder: Path, *, index: str = "") -> str:
    """The page, which lies in `folder`. Picture and output are in it, the log is linked, and the `index` of pages."""
    style = Markup(files("manipcli.report.html").joinpath("page", "report.css").read_text("utf-8"))
    head = element(
        "header",
        element(
            "div", element("h1", report.case.name), element("span", f"✗ {report.outcome}", class_="verdict failed"),
            class_="title",
        ),
        element("p", report.case.file, class_="says"),
    )  # fmt: skip
    causes = [
        element("p", element("span", str(one.place), class_="place") if one.place else None, " ", one.message)
        for one in report.troubles
    ]
    log = element("a", report.log, href=link(report.log, folder)) if report.log is not None else None
    why = element(
        "section",
        *(causes or [element("p", report.text)]),
        *(element("p", line) for line in (*beforehand(report, whole=True), *report.notes)),
        element("p", "log, as far as it got: ", log) if log is not None else None,
        element("p", "again: ", element("code", report.command)),
        class_="why",
    )
    title = f"✗ {report.case.name} {report.outcome}"
    back = element("nav", element("a", "All runs", href=index)) if index else None
    body = element("main", why, _picture(report), _said(report))
    return document(title, head, back, body, style=style, policy=POLICY)


def _picture(report: CaseReport) -> Markup | None:
    if report.picture is None:
        return None
    data = base64.b64encode(Path(report.picture).read_bytes()).decode()
    shown = element("img", src=f"data:image/png;base64,{data}", alt="the last moment of the log")
    return element("section", element("h2", "The last moment of the log"), element("figure", shown))


def _said(report: CaseReport) -> Markup | None:
    if report.output is None:
        return None
    with Path(report.output).open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - LONGEST))
        text = file.read().decode("utf-8", "replace")
    lines = [element("div", line) for line in text.splitlines()]
    return element("section", element("h2", "What it said"), element("pre", *lines, class_="scroll"))
