"""HTML index of many runs: verdict, margin or cause, and duration of each, with a link to its page."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from manipcli.replay.player import POLICY
from manipcli.report.html.markup import Markup, document, element, link
from manipcli.report.html.page_parts import mark, table
from manipcli.report.suite.suite import CaseReport, Suite
from manipcli.report.suite.suite_text import beforehand, gist, render_summary

COLUMNS = ("verdict", "task", "sample or engine", "margin or cause", "duration")


def render_page(suite: Suite, folder: Path) -> str:
    """The file `index.html` of a folder; runs that did not pass come first.

    Args:
        suite: the runs.
        folder: folder of the page; links are relative to it.
    """
    style = Markup(files("manipcli.report.html").joinpath("page", "report.css").read_text("utf-8"))
    passed = sum(report.passed for report in suite.reports)
    good = passed == suite.total > 0
    word = "passed" if good else "failed"
    reports = sorted(suite.reports, key=lambda report: report.passed)
    head = element(
        "header",
        element(
            "div",
            element("h1", f"{passed} of {suite.total} passed"),
            element("span", f"{'✓' if good else '✗'} {word}", class_=f"verdict {word}"),
            class_="title",
        ),
        element("p", render_summary(suite), class_="subtitle"),
    )
    rows = table(COLUMNS, [_row(report, folder) for report in reports], numbers=("duration",), stacks=True)
    title = f"{'✓' if good else '✗'} {passed} of {suite.total} passed"
    return document(title, head, element("main", element("section", rows)), style=style, policy=POLICY)


def _row(report: CaseReport, folder: Path) -> tuple[str, ...]:
    name: str = report.case.file
    if report.page is not None:
        name = element("a", name, href=link(report.page, folder))
    others = [] if report.page is not None else [trouble.message for trouble in report.troubles[1:]]
    more = [] if report.passed else [*others, *beforehand(report, whole=True), element("code", report.command)]
    return (
        mark(report.passed, report.outcome),
        element("div", name, element("div", report.case.task) if report.case.task else None, class_="name"),
        report.case.kind,
        element("div", gist(report), *(element("div", line) for line in more), class_="whole"),
        f"{report.duration:.1f} s",
    )
